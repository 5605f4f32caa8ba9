// A point of the plane and a line from a to b: squared distance, and whether a ray towards +x crosses it.
void profile_line(vec2 p, vec2 a, vec2 b, inout float square, inout bool inside) {
    vec2 way = b - a, off = p - a;
    off -= clamp(dot(off, way) / dot(way, way), 0.0, 1.0) * way;
    square = min(square, dot(off, off));
    if ((a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / way.y * way.x) inside = !inside;
}

// An arc from a to b about a centre: `middle` is the direction from there to its middle, and the cosine of half its angle.
void profile_arc(vec2 p, vec2 a, vec2 b, vec2 centre, float radius, vec3 middle, inout float square) {
    vec2 off = p - centre;
    float reach = length(off);
    bool within = dot(off, middle.xy) >= reach * middle.z;
    float own = within ? (reach - radius) * (reach - radius) : min(dot(p - a, p - a), dot(p - b, p - b));
    square = min(square, own);
}

// Whether a ray towards +x crosses a piece of an arc between two heights, on the right or on the left of its centre.
void profile_piece(vec2 p, vec2 heights, vec2 centre, float radius, bool right, inout bool inside) {
    vec2 off = p - centre;
    bool within = dot(off, off) < radius * radius;
    bool ahead = right ? off.x < 0.0 || within : off.x < 0.0 && !within;
    if (heights.x <= p.y && p.y < heights.y && ahead) inside = !inside;
}

// From the distance to the profile and the height above the bottom; lean: sine and cosine of the taper.
float extruded(float q, float z, float height, vec2 lean) {
    float top = height * lean.x / lean.y, wall = q * lean.y + z * lean.x, along = z * lean.y - q * lean.x;
    float inside = max(wall, max(-z, z - height));
    if (inside <= 0.0) return inside;
    if (z <= 0.0 && q <= 0.0) return -z;
    if (z >= height && q <= -top) return z - height;
    if (along < 0.0) return length(vec2(max(q, 0.0), z));
    if (along > height / lean.y) return length(vec2(max(q + top, 0.0), z - height));
    return wall;
}

// The corner between a wall and an end, u and v beyond them: rounded by rim.x, or else cut off at 45 degrees by rim.y.
float rim_distance(float u, float v, vec2 rim) {
    if (rim.x > 0.0) {
        vec2 over = vec2(u, v) + rim.x;
        return length(max(over, 0.0)) + min(max(over.x, over.y), 0.0) - rim.x;
    }
    float cut = (u + v + rim.y) * 0.70710678, inside = max(max(u, v), cut);
    if (inside <= 0.0) return inside;
    if (v <= -rim.y) return u;
    if (u <= -rim.y) return v;
    if (u - v > rim.y) return length(vec2(u, v + rim.y));
    if (v - u > rim.y) return length(vec2(u + rim.y, v));
    return cut;
}

// As `extruded`, with upright walls and rims: x and y of the bottom's, z and w of the top's.
float extruded_with_rims(float q, float z, float height, vec4 rims) {
    return max(rim_distance(q, -z, rims.xy), rim_distance(q, z - height, rims.zw));
}

// Turned through a part of a circle: distances to the side and to the profile at both flat ends, and off their planes.
float turned_partly(float side, vec2 first, vec2 last, vec2 p, float angle) {
    float ends = min(length(vec2(max(first.x, 0.0), first.y)), length(vec2(max(last.x, 0.0), last.y)));
    float turn = atan(p.y, p.x);
    if ((turn < 0.0 ? turn + 6.283185307 : turn) > angle) return ends;
    return side < 0.0 ? -min(-side, ends) : side;
}
