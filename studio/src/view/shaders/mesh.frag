uniform vec3 uEye;
uniform int uHeat;    // 1: colour by the distance to the assembly
uniform float uMost;  // the distance that the scale ends at
uniform int uCount;

in vec3 vPlace;
in vec3 vNormal;
in vec3 vColour;
flat in float vPart;

layout(location = 0) out uvec4 result;

vec2 octahedral(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return n.z < 0.0 ? folded : n.xy;
}

// Dark blue, green, yellow: even in lightness, and told apart by those who see no red (after viridis).
vec3 heat(float x) {
    const vec3 a = vec3(0.27, 0.0, 0.33), b = vec3(0.23, 0.32, 0.55), c = vec3(0.13, 0.57, 0.55), d = vec3(0.37, 0.79, 0.38), e = vec3(0.99, 0.91, 0.14);
    x = clamp(x, 0.0, 1.0) * 4.0;
    if (x < 1.0) return mix(a, b, x);
    if (x < 2.0) return mix(b, c, x - 1.0);
    return x < 3.0 ? mix(c, d, x - 2.0) : mix(d, e, x - 3.0);
}

void main() {
    vec3 towards = uEye - vPlace;
    vec3 normal = length(vNormal) > 0.0 ? normalize(vNormal) : normalize(cross(dFdx(vPlace), dFdy(vPlace)));
    if (dot(normal, towards) < 0.0) normal = -normal;
    vec3 colour = uHeat == 1 ? heat(abs(field(vPlace, 0, uCount, false)) / uMost) : vColour;
    uvec3 c = uvec3(colour * 255.0 + 0.5);
    result = uvec4(floatBitsToUint(length(towards)), packSnorm2x16(octahedral(normal)), c.x | c.y << 8 | c.z << 16, uint(vPart));
}
