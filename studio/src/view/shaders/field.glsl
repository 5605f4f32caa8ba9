// The signed distance of an assembly whose parts are data: a list of instructions, interpreted.
// After partwright/export/distance.glsl, which has the formulas; lengths are in the unit frame.

uniform highp sampler2D uTable;   // eight texels an instruction, 64 instructions a row
uniform highp usampler2D uList;   // indices of instructions, 2048 a row; after a push, how many entries its group has

const float FAR = 1e9;
const int LEAF = 0, PUSH = 1, POP = 2;
const int UNION = 0, INTERSECTION = 1, SUBTRACT = 2;

vec4 row(int i, int j) { return texelFetch(uTable, ivec2(((i & 63) << 3) + j, i >> 6), 0); }

int listed(int n) { return int(texelFetch(uList, ivec2(n & 2047, n >> 11), 0).x); }

float superfrustum(vec3 v, int i) {
    vec4 a = row(i, 5), b = row(i, 6), c = row(i, 7);
    vec2 place = c.x > 0.0 ? bend(v.x, v.z, a.z, c.xyz) : v.xz;
    float q = cross_section(vec2(place.x, v.y), a.xy, a.w);
    return profile(vec2(q, place.y), a.z, b.yzw, b.z > 1e8) - b.x;
}

float quadric(vec3 v, int i) {
    vec4 a = row(i, 5), b = row(i, 6), c = row(i, 7);
    vec3 linear = vec3(b.z, b.w, c.x);
    vec3 bent = vec3(dot(vec3(a.x, a.w, b.y), v), dot(vec3(a.w, a.y, b.x), v), dot(vec3(b.y, b.x, a.z), v));
    return quadric_reach(dot(bent + linear, v) + c.y, length(2.0 * bent + linear), c.z, c.w);
}

// Of a profile whose sides follow the instructions in the table; axis: whether those on the axis of turning count.
float sides(vec2 p, int first, int count, bool axis) {
    float square = 1e30;
    bool inside = false;
    for (int i = first; i < first + count; i++) {
        vec4 ends = row(i, 0), circle = row(i, 1);
        if (circle.w > 0.0 && !axis) continue;
        if (circle.z == 0.0) {
            profile_line(p, ends.xy, ends.zw, square, inside);
            continue;
        }
        vec4 middle = row(i, 2);
        profile_arc(p, ends.xy, ends.zw, circle.xy, circle.z, middle.xyz, square);
        for (int k = 0; k < int(middle.w); k++) {
            vec4 piece = row(i, 3 + k);
            profile_piece(p, piece.xy, circle.xy, circle.z, piece.z > 0.0, inside);
        }
    }
    return inside ? -sqrt(square) : sqrt(square);
}

float swept(vec3 v, int i) {
    vec4 a = row(i, 5), b = row(i, 6);
    int first = int(a.x), count = int(a.y);
    vec4 rims = row(i, 7);
    if (a.w == 0.0 && dot(rims, rims) > 0.0)
        return extruded_with_rims(sides(v.xy, first, count, true), v.z + a.z / 2.0, a.z, rims);
    if (a.w == 0.0) return extruded(sides(v.xy, first, count, true), v.z + a.z / 2.0, a.z, b.zw);
    float side = sides(vec2(length(v.xy), v.z), first, count, false);
    if (b.x > 0.0) return side;
    vec2 start = vec2(sides(v.xz, first, count, true), v.y);
    vec2 end = vec2(sides(vec2(b.w * v.x + b.z * v.y, v.z), first, count, true), b.w * v.y - b.z * v.x);
    return turned_partly(side, start, end, v.xy, b.y);
}

// Its pieces follow the instructions in the table, and both ends after them.
float piped(vec3 v, int i) {
    vec4 a = row(i, 5);
    int first = int(a.x), last = first + int(a.y);
    float square = 1e30, near = row(i, 6).x;
    for (int k = first; k < last; k++) {
        vec4 at = row(k, 0), way = row(k, 1);
        if (way.w == 0.0) pipe_run(v, at.xyz, way.xyz, at.w, near, square);
        else pipe_bend(v, at.xyz, row(k, 2).xyz, way.xyz, vec3(at.w, row(k, 3).xy), near, square);
    }
    float begin = pipe_end(v, row(last, 0).xyz, row(last, 1).xyz, a.zw);
    return pipe(square, a.zw, begin, pipe_end(v, row(last, 2).xyz, row(last, 3).xyz, a.zw));
}

// kind: 0 a SuperFrustum, 1 swept of a profile, 2 a quadric, 3 a pipe.
float leaf(vec3 p, int i, int kind) {
    vec4 q = vec4(p, 1.0);
    vec3 v = vec3(dot(row(i, 2), q), dot(row(i, 3), q), dot(row(i, 4), q));
    if (kind == 1) return swept(v, i);
    if (kind == 3) return piped(v, i);
    return kind == 2 ? quadric(v, i) : superfrustum(v, i);
}

float fold(int operation, float a, float b, float k) {
    if (operation == UNION) return smooth_union(a, b, k);
    return operation == INTERSECTION ? smooth_intersection(a, b, k) : smooth_difference(a, b, k);
}

// Whether a leaf's ball lies so far off that folding it in changes nothing.
bool beyond(vec3 p, int i, int operation, float result, float k) {
    vec4 ball = row(i, 1);
    vec3 d = p - ball.xyz;
    float bound = (operation == UNION ? result : -result) + k + ball.w;
    return operation != INTERSECTION && (bound <= 0.0 || dot(d, d) > bound * bound);
}

// What is pushed: sixteen deep, shifted through registers, which is much faster than an array.
mat4 stack;

void push(float value) {
    stack[3] = vec4(stack[2].w, stack[3].xyz);
    stack[2] = vec4(stack[1].w, stack[2].xyz);
    stack[1] = vec4(stack[0].w, stack[1].xyz);
    stack[0] = vec4(value, stack[0].xyz);
}

float pop() {
    float value = stack[0].x;
    stack[0] = vec4(stack[0].yzw, stack[1].x);
    stack[1] = vec4(stack[1].yzw, stack[2].x);
    stack[2] = vec4(stack[2].yzw, stack[3].x);
    stack[3] = vec4(stack[3].yzw, 0.0);
    return value;
}

float field(vec3 p, int start, int count, bool exact) {
    float result = FAR;
    int end = start + count;
    for (int n = start; n < end; n++) {
        int i = listed(n);
        vec4 head = row(i, 0);
        int code = int(head.x), action = code >> 4, operation = (code >> 2) & 3;
        if (action == LEAF) {
            if (exact || !beyond(p, i, operation, result, head.y))
                result = fold(operation, result, leaf(p, i, code & 3), head.y);
        } else if (action == PUSH) {
            int length_ = listed(++n);
            // A push knows how its group will be folded in, so that one that lies far off is passed over.
            if (!exact && beyond(p, i, int(head.z), result, head.y)) {
                n += length_;
                continue;
            }
            push(result);
            result = operation == INTERSECTION ? -FAR : FAR;
        } else {
            result = fold(operation, pop(), result, head.y);
        }
    }
    return result;
}
