uniform highp usampler2D uTiles;  // for each tile: where its list begins, its length, nearest and farthest distance
uniform vec3 uEye;
uniform mat3 uAxes;               // to the right, up, towards the viewer
uniform vec4 uPlane;              // half-width and half-height of the picture at distance 1, its centre's shift
uniform vec2 uSize;               // of the picture, in pixels
uniform vec2 uJitter;
uniform vec2 uTileCount;

layout(location = 0) out uint result;  // distance along the ray, 0 where it meets nothing

void main() {
    result = 0u;
    vec2 at = (gl_FragCoord.xy + uJitter) / uSize;
    uvec4 tile = texelFetch(uTiles, ivec2(min(gl_FragCoord.xy / uSize * uTileCount, uTileCount - 1.0)), 0);
    int start = int(tile.x), count = int(tile.y & 0xffffu);
    if (count == 0) return;
    float t = uintBitsToFloat(tile.z), last = uintBitsToFloat(tile.w);
    float relax = (tile.y >> 31) == 1u ? 0.72 : 1.0;  // bent parts stretch distances

    vec2 across = (at * 2.0 - 1.0) * uPlane.xy;
    vec3 ray = normalize(uAxes * vec3(across, -1.0));
    float size = 2.0 * uPlane.y / uSize.y;  // of a pixel at distance 1
    vec3 p;
    bool hit = false;
    float before = FAR;
    for (int i = 0; i < 160; i++) {
        p = uEye + t * ray;
        float d = field(p, start, count, false);
        if (d < 0.25 * size * t) {
            // Steps may have gone in a little: back to the surface.
            t += max(d, -0.5 * before);
            hit = true;
            break;
        }
        before = d;
        t += d * relax;
        if (t > last) break;
    }
    if (hit) result = floatBitsToUint(t);
}
