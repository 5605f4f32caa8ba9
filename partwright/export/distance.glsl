// Distances of parts, from their sizes and from where a point is in their own frames.

const float HALF_PI = 1.5707963267949;

// Built-in arc tangents may be off by 1e-3 on some devices; this one is good to a float's last digits.
float arc_tangent(float y, float x) {  // of (x, y) with x, y >= 0
    float t = min(x, y) / max(max(x, y), 1e-30);
    float s = t * t;
    float r = t * (0.999999985 + s * (-0.333330733 + s * (0.199926194 + s * (-0.142036442 + s * (0.10640933
        + s * (-0.0750429243 + s * (0.0426914943 + s * (-0.0160686135 + s * 0.00284988575))))))));
    return y > x ? HALF_PI - r : r;
}

// Coordinates across and along the axis, an arc through (0, h) and (0, -h); straight on beyond its ends. angle: half
// of the arc's, its sine and its cosine. Lengths are measured times the sine, so that nothing grows as the arc
// straightens.
vec2 bend(float x, float z, float h, vec3 angle) {
    float s = angle.y, k = angle.z;
    float end = abs(z) - h;
    float over = x * s + end * k;
    vec2 bent = vec2(end * s - x * k, h + over);
    if (over <= 0.0) {
        vec2 towards = vec2(k * h - x * s, abs(z) * s);  // from the arc's centre
        bent.x = ((x * x + z * z - h * h) * s - 2.0 * x * k * h) / (length(towards) + h);
        bent.y = h / angle.x * arc_tangent(towards.y, max(towards.x, 0.0));
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
    return vec2((d.x * run.y - d.y * run.x) * inversesqrt(square), dot(off, off));
}

// Signed distance, in the plane of cross-section and height, to the quad between outer and inner edge. The outer one
// goes from 0 at the bottom to edges.x at the top, the inner one from edges.y to edges.z; where the dilation closes the
// hole along its whole length, the inner one is left out.
float profile(vec2 p, float h, vec3 edges, bool closed) {
    vec2 outer = edge(p, 0.0, edges.x, h), inner = outer;
    if (!closed) {
        inner = edge(p, edges.y, edges.z, h);
        inner.x = -inner.x;
    }
    float inside = max(max(outer.x, inner.x), abs(p.y) - h);
    if (inside <= 0.0) return inside;
    vec2 top = vec2(max(p.x - edges.x, 0.0), p.y - h), bottom = vec2(max(p.x, 0.0), p.y + h);
    if (!closed) {
        top.x += max(edges.z - p.x, 0.0);
        bottom.x += max(edges.y - p.x, 0.0);
    }
    return sqrt(min(min(outer.y, inner.y), min(dot(top, top), dot(bottom, bottom))));
}

// A lower bound of the distance to a quadric (Taubin 1994), exact for planes, spheres and round cylinders: of its value
// and its slope at a point, and the curvatures by which it can fall and rise.
float quadric_reach(float value, float steep, float fall, float rise) {
    float size = abs(value);
    float turn = (value < 0.0 ? rise : fall) * size;
    float reach = 2.0 * size / max(steep + sqrt(max(steep * steep + 4.0 * turn, 0.0)), 1e-18);
    return value < 0.0 ? -reach : reach;
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

vec3 into_frame(vec3 p, vec3 translation, vec4 rotation) {
    vec3 v = p - translation, axis = -rotation.xyz;
    return v + 2.0 * cross(axis, cross(axis, v) + rotation.w * v);
}
