struct Part {
    vec3 translation;
    vec4 rotation;    // unit quaternion (x, y, z, w), local to world
    vec3 size;        // full extents before dilation
    float roundness;  // corner radius of the cross-section, a fraction of its smaller half extent: 0..1
    float dilation;   // offset of the whole surface outwards
    float taper;      // width of the top: 1 a prism, 0 a point or ridge, 2 a flare
    float bulge;      // bends the axis into an arc of half angle bulge * pi/2, towards -x: 0..1
    float onion;      // hollows it along the axis: 0 solid, towards 1 a thin tube
    float blend;      // width over which the part melts into what comes before it
};

const float HALF_PI = 1.5707963267949;

// Built-in sine and arc tangent may be off by 1e-3 on some devices; these are good to a float's last digits.
float sine(float x) {  // 0..pi/2
    float s = x * x;
    return x * (1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))));
}

float arc_tangent(float y, float x) {  // of (x, y) with x, y >= 0
    float t = min(x, y) / max(max(x, y), 1e-30);
    float s = t * t;
    float r = t * (0.999999985 + s * (-0.333330733 + s * (0.199926194 + s * (-0.142036442 + s * (0.10640933
        + s * (-0.0750429243 + s * (0.0426914943 + s * (-0.0160686135 + s * 0.00284988575))))))));
    return y > x ? HALF_PI - r : r;
}

// Coordinates across and along the axis, an arc through (0, h) and (0, -h); straight on beyond its ends.
// Lengths are measured times the sine of the half angle, so that nothing grows as the arc straightens.
vec2 bend(float x, float z, float h, float bulge) {
    float theta = bulge * HALF_PI;
    float s = sine(theta), k = sine(HALF_PI - theta);
    float end = abs(z) - h;
    float over = x * s + end * k;
    vec2 bent = vec2(end * s - x * k, h + over);
    if (over <= 0.0) {
        vec2 towards = vec2(k * h - x * s, abs(z) * s);  // from the arc's centre
        bent.x = ((x * x + z * z - h * h) * s - 2.0 * x * k * h) / (length(towards) + h);
        bent.y = h / theta * arc_tangent(towards.y, max(towards.x, 0.0));
    }
    return vec2(bent.x, z < 0.0 ? -bent.y : bent.y);
}

// Signed distance to a rectangle with rounded corners.
float cross_section(vec2 p, vec2 half_extents, float radius) {
    vec2 q = abs(p) - half_extents + radius;
    return length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - radius;
}

// Signed distance to the line from (bottom, -h) to (top, h), and squared distance to the segment.
vec2 edge(vec2 p, float bottom, float top, float h) {
    vec2 d = vec2(p.x - bottom, p.y + h), run = vec2(top - bottom, 2.0 * h);
    float square = dot(run, run);
    vec2 off = d - clamp(dot(d, run) / square, 0.0, 1.0) * run;
    return vec2((d.x * run.y - d.y * run.x) / sqrt(square), dot(off, off));
}

// Signed distance, in the plane of cross-section and height, to the quad between outer and inner edge. Where
// the dilation closes the hole along its whole length the inner edge is left out.
float profile(vec2 p, float m, float h, Part f) {
    bool closed = max(f.taper, 1.0) * m * f.onion <= f.dilation;
    float outer_top = m * (f.taper - 1.0);
    float inner_top = m * (f.taper * f.onion - 1.0), inner_bottom = m * (f.onion - 1.0);
    vec2 outer = edge(p, 0.0, outer_top, h), inner = edge(p, inner_bottom, inner_top, h);
    inner = closed ? outer : vec2(-inner.x, inner.y);
    float inside = max(max(outer.x, inner.x), abs(p.y) - h);
    if (inside <= 0.0) return inside;
    vec2 top = vec2(max(p.x - outer_top, 0.0), p.y - h), bottom = vec2(max(p.x, 0.0), p.y + h);
    if (!closed) {
        top.x += max(inner_top - p.x, 0.0);
        bottom.x += max(inner_bottom - p.x, 0.0);
    }
    return sqrt(min(min(outer.y, inner.y), min(dot(top, top), dot(bottom, bottom))));
}

float part_sdf(vec3 p, Part f) {
    vec3 v = p - f.translation, axis = -f.rotation.xyz;
    v += 2.0 * cross(axis, cross(axis, v) + f.rotation.w * v);
    float m = min(f.size.x, f.size.y) / 2.0;
    float h = f.size.z / 2.0 + 1e-12;  // no edge has length zero
    vec2 across_along = f.bulge > 0.0 ? bend(v.x, v.z, h, f.bulge) : v.xz;
    float q = cross_section(vec2(across_along.x, v.y), f.size.xy / 2.0, f.roundness * m);
    return profile(vec2(q, across_along.y), m, h, f) - f.dilation;
}

// Polynomial smooth minimum with blend radius k; 0 is the plain minimum.
float smooth_union(float a, float b, float k) {
    float shared_width = max(k - abs(a - b), 0.0);
    return min(a, b) - (k > 1e-9 ? shared_width * shared_width / (4.0 * k) : 0.0);
}

float smooth_difference(float a, float b, float k) {
    return -smooth_union(-a, b, k);
}

float smooth_intersection(float a, float b, float k) {
    return -smooth_union(-a, -b, k);
}
