layout(location = 0) in vec3 aPlace;
layout(location = 1) in vec3 aNormal;
layout(location = 2) in vec4 aColour;  // and the part + 1, of meshes that stand in for parts

uniform vec3 uEye;
uniform mat3 uAxes;
uniform vec4 uPlane;

out vec3 vPlace;
out vec3 vNormal;
out vec3 vColour;
flat out float vPart;

void main() {
    vec3 v = transpose(uAxes) * (aPlace - uEye);
    vPlace = aPlace;
    vNormal = aNormal;
    vColour = aColour.rgb;
    vPart = floor(aColour.a * 255.0 + 0.5);
    float depth = -v.z;
    gl_Position = vec4(v.xy / uPlane.xy, depth * 1.0002 - 0.002, depth);
}
