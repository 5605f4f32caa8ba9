// Squared distance from a straight piece of a path, which begins at a place and runs `size` on, where a foot on it is;
// feet so little beyond its ends count.
void pipe_run(vec3 p, vec3 start, vec3 way, float size, float near, inout float square) {
    vec3 off = p - start;
    float along = dot(off, way);
    off -= along * way;
    if (along >= -near && along <= size + near) square = min(square, dot(off, off));
}

// From an arc about a centre, from where `outwards` points towards `along`; turn: its radius, and cosine and sine of its
// angle.
void pipe_bend(vec3 p, vec3 centre, vec3 outwards, vec3 along, vec3 turn, float near, inout float square) {
    vec3 off = p - centre;
    float x = dot(off, outwards), y = dot(off, along), reach = length(vec2(x, y)) - turn.x;
    off -= x * outwards + y * along;
    bool there = y >= -near && y * turn.y - x * turn.z <= near;
    if (there) square = min(square, reach * reach + dot(off, off));
}

// To the section, from its middle; radii: outer, and of the bore, which is far below 0 where there is none.
float pipe_across(float reach, vec2 radii) { return max(reach - radii.x, radii.y - reach); }

// To a flat end, without sign.
float pipe_end(vec3 p, vec3 place, vec3 outwards, vec2 radii) {
    vec3 off = p - place;
    float above = dot(off, outwards);
    return length(vec2(max(pipe_across(length(off - above * outwards), radii), 0.0), above));
}

// From the squared distance to the path and the distances to both ends.
float pipe(float square, vec2 radii, float first, float last) {
    float wall = pipe_across(sqrt(square), radii), ends = min(first, last);
    return wall < 0.0 ? max(wall, -ends) : min(wall, ends);
}
