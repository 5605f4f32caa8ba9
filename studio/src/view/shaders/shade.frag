// Normal, colour and part where the rays have met the surface.
uniform highp sampler2D uColours; // of parts, 256 a row
uniform highp sampler2DArray uMaps; // of parts: octahedral, of the outside and of a hollow part's inside
const int LAYERS = 512; // as in the table: images of colours are counted up to it, those of normals in multiples

vec3 texel(ivec2 at, int side, int layer) {
    int n = textureSize(uMaps, 0).y;
    at = clamp(at, ivec2(0), ivec2(n - 1));
    return texelFetch(uMaps, ivec3(at.x + side * n, at.y, layer), 0).rgb;
}

// Where on a part's map a point of its own frame is (partwright/textures/coordinates.py): by the direction in shares of
// its half extents, in the octant that is given by its signs, if any; and whether it is on the inside.
vec3 mapPlace(vec3 v, int i, inout vec3 octant) {
    vec4 a = row(i, 5), b = row(i, 6), c = row(i, 7);
    vec2 place = c.x > 0.0 ? bend(v.x, v.z, a.z, c.xyz) : v.xz;
    float across = cross_section(vec2(place.x, v.y), a.xy, a.w);
    float t = clamp((place.y / a.z + 1.0) / 2.0, 0.0, 1.0);
    bool inner = b.z < 1e8 && across < (b.y * t + mix(b.z, b.w, t)) / 2.0;
    vec3 n = vec3(place.x, v.y, place.y) / max(a.xyz + b.x, 1e-9);
    if (octant == vec3(0.0)) octant = vec3(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0, n.z < 0.0 ? -1.0 : 1.0);
    n /= max(abs(n.x) + abs(n.y) + abs(n.z), 1e-9);
    return vec3(octant.z < 0.0 ? (1.0 - abs(n.yx)) * octant.xy : n.xy, inner ? 1.0 : 0.0);
}

vec3 mapTexel(vec3 place, int layer) {
    vec2 at = (place.xy / 2.0 + 0.5) * float(textureSize(uMaps, 0).y) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 s = at - floor(at);
    int side = int(place.z);
    return mix(mix(texel(low, side, layer), texel(low + ivec2(1, 0), side, layer), s.x),
               mix(texel(low + ivec2(0, 1), side, layer), texel(low + ivec2(1), side, layer), s.x), s.y);
}

vec3 inPart(vec4 q, int i) { return vec3(dot(row(i, 2), q), dot(row(i, 3), q), dot(row(i, 4), q)); }

// Colour of a part's own map at a point.
vec3 mapped(vec3 p, int i, int layer) {
    vec3 octant = vec3(0.0);
    return mapTexel(mapPlace(inPart(vec4(p, 1.0), i), i, octant), layer);
}

// The normal there as the part's own map bends it: x along the map's rows, y up its columns, z away from the surface.
vec3 bentNormal(vec3 p, int i, int layer, vec3 normal) {
    vec3 v = inPart(vec4(p, 1.0), i), away = normalize(inPart(vec4(normal, 0.0), i)), octant = vec3(0.0);
    vec3 place = mapPlace(v, i, octant);
    vec4 a = row(i, 5);
    float e = 1e-3 * (max(a.x, max(a.y, a.z)) + row(i, 6).x);
    vec3 along = vec3(0.0), up = vec3(0.0);
    for (int k = 0; k < 3; k++) {
        vec3 step_ = vec3(k == 0 ? e : 0.0, k == 1 ? e : 0.0, k == 2 ? e : 0.0);
        vec2 slope = mapPlace(v + step_, i, octant).xy - mapPlace(v - step_, i, octant).xy;
        along[k] = slope.x;
        up[k] = slope.y;
    }
    up -= dot(up, away) * away;
    vec3 tangent = cross(up, away);
    if (dot(tangent, tangent) < 1e-20) return normal;
    tangent = normalize(dot(tangent, along) < 0.0 ? -tangent : tangent);
    vec3 other = cross(away, tangent);
    vec3 bent = 2.0 * mapTexel(place, layer) - 1.0;
    bent = bent.x * tangent + bent.y * (dot(other, up) < 0.0 ? -other : other) + bent.z * away;
    return normalize(bent.x * row(i, 2).xyz + bent.y * row(i, 3).xyz + bent.z * row(i, 4).xyz);
}

mat4 shades;  // rgb in 24 bits, pushed beside the distances
mat4 owners;

void pushShade(float shade, float owner) {
    shades[3] = vec4(shades[2].w, shades[3].xyz);
    shades[2] = vec4(shades[1].w, shades[2].xyz);
    shades[1] = vec4(shades[0].w, shades[1].xyz);
    shades[0] = vec4(shade, shades[0].xyz);
    owners[3] = vec4(owners[2].w, owners[3].xyz);
    owners[2] = vec4(owners[1].w, owners[2].xyz);
    owners[1] = vec4(owners[0].w, owners[1].xyz);
    owners[0] = vec4(owner, owners[0].xyz);
}

vec2 popShade() {
    vec2 value = vec2(shades[0].x, owners[0].x);
    shades[0] = vec4(shades[0].yzw, shades[1].x);
    shades[1] = vec4(shades[1].yzw, shades[2].x);
    shades[2] = vec4(shades[2].yzw, shades[3].x);
    owners[0] = vec4(owners[0].yzw, owners[1].x);
    owners[1] = vec4(owners[1].yzw, owners[2].x);
    owners[2] = vec4(owners[2].yzw, owners[3].x);
    return value;
}

float packed(vec3 c) { return dot(floor(c * 255.0 + 0.5), vec3(1.0, 256.0, 65536.0)); }
vec3 unpacked(float c) { return vec3(mod(c, 256.0), mod(floor(c / 256.0), 256.0), floor(c / 65536.0)) / 255.0; }

// Colour of the surface at p, and in `leaf_` the instruction of the part whose own surface is there, or -1.
vec3 colourAt(vec3 p, int start, int count, out int leaf_) {
    float result = FAR, owner = -1.0;
    vec3 colour = vec3(0.5);
    int end = start + count;
    for (int n = start; n < end; n++) {
        int i = listed(n);
        vec4 head = row(i, 0);
        int code = int(head.x), action = code >> 4, operation = (code >> 2) & 3;
        if (action == PUSH) {
            int length_ = listed(++n);
            if (beyond(p, i, int(head.z), result, head.y)) {
                n += length_;
                continue;
            }
            push(result);
            pushShade(packed(colour), owner);
            result = operation == INTERSECTION ? -FAR : FAR;
            owner = -1.0;
            continue;
        }
        float next = result, nextOwner = owner;
        vec3 nextColour = colour;
        if (action == POP) {
            result = pop();
            vec2 before = popShade();
            colour = unpacked(before.x);
            owner = before.y;
        } else {
            if (beyond(p, i, operation, result, head.y)) continue;
            int index = int(head.z);
            int layer = int(head.w) % LAYERS - 1;
            nextColour = layer >= 0 ? mapped(p, i, layer) : texelFetch(uColours, ivec2(index & 255, index >> 8), 0).rgb;
            next = leaf(p, i, code & 3);
            nextOwner = float(i);
        }
        // Positive where the next one's surface is the nearer to what is seen.
        float lead = operation == UNION ? result - next : operation == SUBTRACT ? -next - result : next - result;
        float weight = head.y > 1e-9 ? clamp(0.5 + 0.5 * lead / head.y, 0.0, 1.0) : (lead > 0.0 ? 1.0 : 0.0);
        colour = mix(colour, nextColour, weight);
        result = fold(operation, result, next, head.y);
        if (weight > 0.5) owner = nextOwner;
    }
    leaf_ = int(owner);
    return colour;
}

uniform highp usampler2D uTiles;
uniform highp usampler2D uMarched;  // distances along the rays; 0 where nothing was met
uniform vec3 uEye;
uniform mat3 uAxes;
uniform vec4 uPlane;
uniform vec2 uSize;
uniform vec2 uJitter;
uniform vec2 uTileCount;

layout(location = 0) out uvec4 result;  // distance along the ray, normal, colour, part + 1

vec2 octahedral(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return n.z < 0.0 ? folded : n.xy;
}

void main() {
    result = uvec4(0u);
    float t = uintBitsToFloat(texelFetch(uMarched, ivec2(gl_FragCoord.xy), 0).x);
    if (t == 0.0) return;
    vec2 at = (gl_FragCoord.xy + uJitter) / uSize;
    uvec4 tile = texelFetch(uTiles, ivec2(min(gl_FragCoord.xy / uSize * uTileCount, uTileCount - 1.0)), 0);
    int start = int(tile.x), count = int(tile.y & 0xffffu);
    vec3 ray = normalize(uAxes * vec3((at * 2.0 - 1.0) * uPlane.xy, -1.0));
    float size = 2.0 * uPlane.y / uSize.y;
    vec3 p = uEye + t * ray;
    float e = max(0.5 * size * t, 2e-5);
    // One loop, so that the field is in the shader once.
    vec3 normal = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        vec3 k = vec3(i == 0 || i == 3 ? 1.0 : -1.0, i == 2 || i == 3 ? 1.0 : -1.0, i == 1 || i == 3 ? 1.0 : -1.0);
        normal += k * field(p + e * k, start, count, false);
    }
    normal = normalize(normal);
    int leaf_;
    vec3 colour = colourAt(p, start, count, leaf_);
    vec4 head = leaf_ < 0 ? vec4(0.0) : row(leaf_, 0);
    int part = leaf_ < 0 ? -1 : int(head.z), relief = int(head.w) / LAYERS - 1;
    if (relief >= 0) normal = bentNormal(p, leaf_, relief, normal);
    uvec3 c = uvec3(colour * 255.0 + 0.5);
    result = uvec4(floatBitsToUint(t), packSnorm2x16(octahedral(normal)), c.x | c.y << 8 | c.z << 16, uint(part + 1));
}
