// What is seen, from what was found along each ray: light, outlines, grid.
uniform highp usampler2D uField;
uniform highp usampler2D uMesh;
uniform highp usampler2D uLearned;  // parts that are meshes
uniform highp usampler2D uMarks;  // of parts: 1 selected, 2 hovered, 4 faded; 256 a row
uniform vec3 uEye;
uniform mat3 uAxes;
uniform vec4 uPlane;
uniform vec2 uSize;
uniform vec2 uJitter;
uniform vec2 uOrigin;
uniform int uShow;      // 0 the assembly, 1 the mesh, 2 both, 3 a wipe
uniform float uWipe;
uniform vec3 uPaper;
uniform vec3 uInk;
uniform vec3 uAccent;
uniform vec4 uGround;   // normal and place of the ground
uniform float uGrid;    // its spacing; 0 is none
uniform int uOutlines;  // whether anything is marked

layout(location = 0) out vec4 result;

vec3 unpackNormal(uint packed_) {
    vec2 e = unpackSnorm2x16(packed_);
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return normalize(n);
}

ivec2 cell(vec2 place, ivec2 size) { return clamp(ivec2(place * vec2(size)), ivec2(0), size - 1); }

float depth(uvec4 what) { return what.x == 0u ? 1e9 : uintBitsToFloat(what.x); }

uvec4 found(vec2 place) {
    uvec4 a = texelFetch(uField, cell(place, textureSize(uField, 0)), 0);
    uvec4 c = texelFetch(uLearned, cell(place, textureSize(uLearned, 0)), 0);
    if (depth(c) < depth(a)) a = c;
    if (uShow == 0) return a;
    uvec4 b = texelFetch(uMesh, cell(place, textureSize(uMesh, 0)), 0);
    if (uShow == 1) return b;
    if (uShow == 3) return place.x < uWipe ? b : a;
    return depth(a) < depth(b) + 0.004 ? a : b;
}

uint marks(uvec4 what) {
    int part = int(what.w) - 1;
    return part < 0 ? 0u : texelFetch(uMarks, ivec2(part & 255, part >> 8), 0).x;
}

const vec2 AROUND[6] = vec2[](vec2(0.94, 0.34), vec2(0.18, 0.98), vec2(-0.77, 0.64), vec2(-0.94, -0.34), vec2(-0.18, -0.98), vec2(0.77, -0.64));

vec3 toLinear(vec3 c) { return c * c * (c * 0.305306011 + 0.682171111) + c * 0.012522878; }
vec3 toScreen(vec3 c) { return max(1.055 * pow(max(c, 0.0), vec3(0.416666667)) - 0.055, 0.0); }

float gridLine(vec2 at, float spacing, vec2 width) {
    vec2 off = abs(fract(at / spacing - 0.5) - 0.5) * spacing;
    vec2 line = 1.0 - smoothstep(0.5 * width, 1.5 * width, off);
    return max(line.x, line.y);
}

vec3 background(vec3 ray, float limit) {
    vec3 paper = uPaper;
    if (uGrid <= 0.0) return paper;
    float slope = dot(ray, uGround.xyz);
    float t = (uGround.w - dot(uEye, uGround.xyz)) / slope;
    if (t <= 0.0 || t > limit) return paper;
    vec3 p = uEye + t * ray;
    vec3 across = normalize(abs(uGround.x) > 0.5 ? vec3(0, 1, 0) : vec3(1, 0, 0));
    vec3 along = cross(uGround.xyz, across);
    vec2 at = vec2(dot(p, across), dot(p, along));
    float pixel = 2.0 * uPlane.y / uSize.y * t;
    vec2 width = vec2(pixel / max(abs(slope), 0.05));
    float fade = exp(-dot(at, at) * 0.22) * smoothstep(0.0, 0.15, abs(slope));
    float line = 0.09 * gridLine(at, uGrid, width) + 0.13 * gridLine(at, 10.0 * uGrid, width);
    return mix(paper, uInk, line * fade);
}

void main() {
    vec2 place = (gl_FragCoord.xy - uOrigin) / uSize;
    vec2 at = (gl_FragCoord.xy - uOrigin + uJitter) / uSize;
    vec3 ray = normalize(uAxes * vec3((at * 2.0 - 1.0) * uPlane.xy, -1.0));
    uvec4 here = found(place);
    float t = here.x == 0u ? 1e9 : uintBitsToFloat(here.x);
    vec3 colour = background(ray, t);
    vec2 pixel = 1.0 / uSize;
    uint mark = marks(here);
    if (here.x != 0u) {
        vec3 normal = unpackNormal(here.y);
        vec3 base = toLinear(vec3(here.z & 255u, (here.z >> 8) & 255u, (here.z >> 16) & 255u) / 255.0);
        vec3 up = uGround.xyz;
        vec3 key = normalize(uAxes * vec3(-0.45, 0.6, 0.66));
        vec3 rim = normalize(uAxes * vec3(0.8, -0.1, 0.35));
        float sky = 0.5 + 0.5 * dot(normal, up);
        float light = 0.34 + 0.26 * sky + 0.62 * max(dot(normal, key), 0.0) + 0.12 * max(dot(normal, rim), 0.0);
        vec3 halfway = normalize(key - ray);
        float shine = 0.10 * pow(max(dot(normal, halfway), 0.0), 40.0);
        // What lies in front of its neighbours by little darkens them.
        float shade = 0.0;
        for (int i = 0; i < 6; i++) {
            vec2 step_ = AROUND[i] * pixel * (4.0 + 2.5 * float(i & 1)) * uSize.y / 800.0;
            uvec4 there = found(place + step_);
            if (there.x == 0u) continue;
            vec3 towards = uAxes * vec3(((at + step_) * 2.0 - 1.0) * uPlane.xy, -1.0);
            vec3 gap = normalize(towards) * uintBitsToFloat(there.x) - ray * t;
            float rise = dot(gap, normal) / max(length(gap), 1e-5);
            shade += clamp(rise - 0.12, 0.0, 1.0) * clamp(1.0 - length(gap) / 0.15, 0.0, 1.0);
        }
        light *= 1.0 - min(0.12 * shade, 0.45);
        vec3 lit = base * light + shine;
        if ((mark & 2u) != 0u) lit = mix(lit, vec3(1.0), 0.14);
        if ((mark & 1u) != 0u) lit = mix(lit, toLinear(uAccent), 0.10);
        colour = toScreen(lit);
        if ((mark & 4u) != 0u) colour = mix(colour, uPaper, 0.55);
    }
    // Outlines of what is selected, and of what the pointer is over.
    float selected = 0.0, hovered = 0.0;
    for (int i = 0; i < 8 && uOutlines == 1; i++) {
        float angle = 0.785398 * float(i);
        uint there = marks(found(place + vec2(cos(angle), sin(angle)) * pixel * 1.8 * max(uSize.y / 900.0, 1.0)));
        if (((there ^ mark) & 1u) != 0u) selected += 0.25;
        if (((there ^ mark) & 2u) != 0u) hovered += 0.2;
    }
    colour = mix(colour, uInk, min(hovered, 0.55));
    colour = mix(colour, uAccent, min(selected, 1.0));
    if (uShow == 3 && abs(gl_FragCoord.x - uOrigin.x - uWipe * uSize.x) < 0.75 * max(uSize.y / 900.0, 1.0)) colour = uInk;
    result = vec4(colour, 1.0);
}
