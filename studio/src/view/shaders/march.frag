uniform highp usampler2D uTiles;  // for each tile: where its list begins, its length, nearest and farthest distance
uniform vec3 uEye;
uniform mat3 uAxes;               // to the right, up, towards the viewer
uniform vec4 uPlane;              // half-width and half-height of the picture at distance 1, its centre's shift
uniform vec2 uSize;               // of the picture, in pixels
uniform vec2 uJitter;
uniform vec2 uTileCount;
uniform highp usampler2D uBegin;  // how far the cones around blocks of pixels have come
uniform float uCone;              // radius of a block's cone at distance 1; 0 marches rays, from where their cones ended

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
    if (uCone == 0.0) {
        uint begun = texelFetch(uBegin, ivec2(gl_FragCoord.xy / uSize * vec2(textureSize(uBegin, 0))), 0).x;
        if (begun == 0u) return;
        t = max(t, uintBitsToFloat(begun));
    }
    bool hit = false;
    float before = FAR;
    for (int i = 0; i < 160; i++) {
        float d = field(uEye + t * ray, start, count, false);
        if (uCone > 0.0) {
            // As far as no ray of the block can have met anything.
            float room = d * relax - uCone * t;
            if (room < 0.02 * uCone * t) {
                hit = true;
                break;
            }
            t += room / (1.0 + uCone);
        } else {
            if (d < 0.25 * size * t) {
                // Steps may have gone in a little: back to the surface.
                t += max(d, -0.5 * before);
                hit = true;
                break;
            }
            before = d;
            t += d * relax;
        }
        if (t > last) break;
    }
    if (hit || (uCone > 0.0 && t <= last)) result = floatBitsToUint(t);
}
