// Distances at given points, for comparison with the package's own.
uniform highp sampler2D uPoints;  // 1024 a row
uniform int uCount;

layout(location = 0) out uvec4 result;

void main() {
    vec3 p = texelFetch(uPoints, ivec2(gl_FragCoord.xy), 0).xyz;
    result = uvec4(floatBitsToUint(field(p, 0, uCount, true)), 0u, 0u, 0u);
}
