"""Runs a shader's `sdf` without a screen, by whatever OpenGL 4.3 there is (Mesa's llvmpipe needs no card)."""

from __future__ import annotations

import numpy as np
import pytest

_MAIN = """
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(values.length())) {
        values[i] = sdf(vec3(points[3u * i], points[3u * i + 1u], points[3u * i + 2u]));
    }
}
"""


def run_sdf(source: str, points: np.ndarray) -> np.ndarray:
    """(N,) values at points (N, 3); skips the test where no OpenGL can be had."""
    moderngl = pytest.importorskip("moderngl")
    try:
        context = moderngl.create_context(standalone=True, backend="egl", require=430)
    except Exception as error:  # moderngl raises plain Exceptions
        pytest.skip(f"no headless OpenGL 4.3 (Debian: libegl1 libgl1-mesa-dri): {error}")
    head = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Points { float points[]; };
layout(std430, binding = 1) buffer Values { float values[]; };
"""
    try:
        program = context.compute_shader(head + source + _MAIN)
        given = context.buffer(np.ascontiguousarray(points, np.float32).tobytes())
        answer = context.buffer(reserve=4 * len(points))
        given.bind_to_storage_buffer(0)
        answer.bind_to_storage_buffer(1)
        program.run(-(-len(points) // 64))
        context.finish()
        return np.frombuffer(answer.read(), np.float32)
    finally:
        context.release()
