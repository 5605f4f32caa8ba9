/** Where the picture is taken from: an orbit around a target, in the unit frame. */

import { type Box, type Vec3, add, corners, cross, dot, middle, mul, sub, unit } from "../model/vectors";

export const FIELD_OF_VIEW = 26; // degrees of the picture's height
const FILLED = 0.92; // of the picture's width or height, by what is framed

// Up axis -> the side that azimuth 0 looks at.
const FRONTS: Record<string, Vec3> = { x: [0, -1, 0], y: [0, 0, 1], z: [0, -1, 0] };

export interface View {
  eye: Vec3;
  right: Vec3;
  up: Vec3;
  back: Vec3;
  /** Half-width and half-height of the picture at distance 1. */
  half: [number, number];
}

export class Camera {
  azimuth = 32;
  elevation = 24;
  target: Vec3 = [0, 0, 0];
  distance = 5;
  above: Vec3 = [0, 0, 1];
  private front: Vec3 = FRONTS.z;
  private side: Vec3 = [1, 0, 0];

  constructor(up: string | null) {
    this.stand(up);
  }

  /** With this axis up. */
  stand(up: string | null): void {
    const axis = up?.replace("-", "") ?? "z";
    this.above = [0, 0, 0];
    this.above["xyz".indexOf(axis in FRONTS ? axis : "z")] = up?.startsWith("-") ? -1 : 1;
    this.front = FRONTS[axis in FRONTS ? axis : "z"];
    this.side = cross(this.above, this.front);
  }

  view(aspect: number): View {
    const [a, e] = [(this.azimuth * Math.PI) / 180, (this.elevation * Math.PI) / 180];
    const level = add(mul(this.front, Math.cos(a)), mul(this.side, Math.sin(a)));
    const back = add(mul(level, Math.cos(e)), mul(this.above, Math.sin(e)));
    const up = sub(mul(this.above, Math.cos(e)), mul(level, Math.sin(e)));
    const high = Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    return {
      eye: add(this.target, mul(back, this.distance)),
      right: cross(up, back),
      up,
      back,
      half: [high * aspect, high],
    };
  }

  orbit(dx: number, dy: number): void {
    this.azimuth = (this.azimuth - dx) % 360;
    this.elevation = Math.max(-89.5, Math.min(89.5, this.elevation + dy));
  }

  /** By pixels of a picture that is `height` of them high. */
  pan(dx: number, dy: number, height: number): void {
    const view = this.view(1);
    const size = (2 * view.half[1] * this.distance) / height;
    this.target = add(this.target, add(mul(view.right, -dx * size), mul(view.up, dy * size)));
  }

  zoom(factor: number): void {
    this.distance = Math.max(0.05, Math.min(60, this.distance * factor));
  }

  /** So that a box fills the picture; directions stay. */
  frame(box: Box, aspect: number): void {
    this.target = middle(box);
    const { right, up, back, half } = this.view(aspect);
    const needed = corners(box).map((corner) => {
      const at = sub(corner, this.target);
      return dot(at, back) + Math.max(Math.abs(dot(at, right)) / half[0], Math.abs(dot(at, up)) / half[1]) / FILLED;
    });
    this.distance = Math.max(...needed, 0.05);
  }
}

/** Pixel (from the top left) of a point, and its depth; not in front of the eye where depth <= 0. */
export function project(view: View, p: Vec3, width: number, height: number): { x: number; y: number; depth: number } {
  const v = sub(p, view.eye);
  const depth = -dot(v, view.back);
  const x = dot(v, view.right) / (depth * view.half[0]);
  const y = dot(v, view.up) / (depth * view.half[1]);
  return { x: ((x + 1) / 2) * width, y: ((1 - y) / 2) * height, depth };
}

/** Unit direction through a pixel from the top left. */
export function rayThrough(view: View, x: number, y: number, width: number, height: number): Vec3 {
  const across = mul(view.right, ((2 * x) / width - 1) * view.half[0]);
  const along = mul(view.up, (1 - (2 * y) / height) * view.half[1]);
  return unit(sub(add(across, along), view.back));
}
