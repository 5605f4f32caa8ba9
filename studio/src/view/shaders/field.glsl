// The signed distance of an assembly whose parts are data: a list of instructions, interpreted.
// Formulas as in partwright/export/superfrustum.glsl and quadric.glsl, lengths in the unit frame.

uniform highp sampler2D uTable;   // eight texels an instruction, 64 instructions a row
uniform highp usampler2D uList;   // indices of instructions, 2048 a row; after a push, how many entries its group has

const float FAR = 1e9;
const int LEAF = 0, PUSH = 1, POP = 2;
const int UNION = 0, INTERSECTION = 1, SUBTRACT = 2;
const float HALF_PI = 1.5707963267949;

vec4 row(int i, int j) { return texelFetch(uTable, ivec2(((i & 63) << 3) + j, i >> 6), 0); }

int listed(int n) { return int(texelFetch(uList, ivec2(n & 2047, n >> 11), 0).x); }

float arcTangent(float y, float x) {  // of (x, y) with x, y >= 0; built-in ones may be off by 1e-3
    float t = min(x, y) / max(max(x, y), 1e-30);
    float s = t * t;
    float r = t * (0.999999985 + s * (-0.333330733 + s * (0.199926194 + s * (-0.142036442 + s * (0.10640933
        + s * (-0.0750429243 + s * (0.0426914943 + s * (-0.0160686135 + s * 0.00284988575))))))));
    return y > x ? HALF_PI - r : r;
}

vec2 bend(float x, float z, float h, vec3 angle) {  // angle, its sine and cosine
    float s = angle.y, k = angle.z;
    float end = abs(z) - h;
    float over = x * s + end * k;
    vec2 bent = vec2(end * s - x * k, h + over);
    if (over <= 0.0) {
        vec2 towards = vec2(k * h - x * s, abs(z) * s);
        bent.x = ((x * x + z * z - h * h) * s - 2.0 * x * k * h) / (length(towards) + h);
        bent.y = h / angle.x * arcTangent(towards.y, max(towards.x, 0.0));
    }
    return vec2(bent.x, z < 0.0 ? -bent.y : bent.y);
}

vec2 edge(vec2 p, float bottom, float top, float h) {
    vec2 d = vec2(p.x - bottom, p.y + h), run = vec2(top - bottom, 2.0 * h);
    float square = dot(run, run);
    vec2 off = d - clamp(dot(d, run) / square, 0.0, 1.0) * run;
    return vec2((d.x * run.y - d.y * run.x) * inversesqrt(square), dot(off, off));
}

float superfrustum(vec3 v, int i) {
    vec4 a = row(i, 5), b = row(i, 6), c = row(i, 7);
    float h = a.z;
    vec2 place = c.x > 0.0 ? bend(v.x, v.z, h, c.xyz) : v.xz;
    vec2 q = abs(vec2(place.x, v.y)) - a.xy + a.w;
    vec2 p = vec2(length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - a.w, place.y);
    float outerTop = b.y, innerBottom = b.z, innerTop = b.w;
    bool closed = innerBottom > 1e8;
    vec2 outer = edge(p, 0.0, outerTop, h), inner = outer;
    if (!closed) {
        inner = edge(p, innerBottom, innerTop, h);
        inner.x = -inner.x;
    }
    float inside = max(max(outer.x, inner.x), abs(p.y) - h);
    if (inside <= 0.0) return inside - b.x;
    vec2 top = vec2(max(p.x - outerTop, 0.0), p.y - h), bottom = vec2(max(p.x, 0.0), p.y + h);
    if (!closed) {
        top.x += max(innerTop - p.x, 0.0);
        bottom.x += max(innerBottom - p.x, 0.0);
    }
    return sqrt(min(min(outer.y, inner.y), min(dot(top, top), dot(bottom, bottom)))) - b.x;
}

float quadric(vec3 v, int i) {
    vec4 a = row(i, 5), b = row(i, 6), c = row(i, 7);
    vec3 linear = vec3(b.z, b.w, c.x);
    vec3 bent = vec3(dot(vec3(a.x, a.w, b.y), v), dot(vec3(a.w, a.y, b.x), v), dot(vec3(b.y, b.x, a.z), v));
    float value = dot(bent + linear, v) + c.y;
    float steep = length(2.0 * bent + linear), size = abs(value);
    float turn = (value < 0.0 ? c.w : c.z) * size;
    float reach = 2.0 * size / max(steep + sqrt(max(steep * steep + 4.0 * turn, 0.0)), 1e-18);
    return value < 0.0 ? -reach : reach;
}

float leaf(vec3 p, int i, bool isQuadric) {
    vec4 q = vec4(p, 1.0);
    vec3 v = vec3(dot(row(i, 2), q), dot(row(i, 3), q), dot(row(i, 4), q));
    return isQuadric ? quadric(v, i) : superfrustum(v, i);
}

float smoothUnion(float a, float b, float k) {
    float shared_ = max(k - abs(a - b), 0.0);
    return min(a, b) - (k > 1e-9 ? shared_ * shared_ / (4.0 * k) : 0.0);
}

float fold(int operation, float a, float b, float k) {
    if (operation == UNION) return smoothUnion(a, b, k);
    return operation == INTERSECTION ? -smoothUnion(-a, -b, k) : -smoothUnion(-a, b, k);
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
                result = fold(operation, result, leaf(p, i, (code & 2) != 0), head.y);
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
