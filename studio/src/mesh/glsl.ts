/** One self-contained `float sdf(vec3 p)`, as `partwright export -o FILE.glsl` writes it. */

import distanceFormula from "../../../partwright/export/distance.glsl?raw";
import pipeFormula from "../../../partwright/export/pipe.glsl?raw";
import profileFormula from "../../../partwright/export/profile.glsl?raw";
import quadricFormula from "../../../partwright/export/quadric.glsl?raw";
import superfrustumFormula from "../../../partwright/export/superfrustum.glsl?raw";
import { quadric, superfrustum } from "../model/fields";
import { isPipe, NO_BORE, pipe } from "../model/pipes";
import { hasRims, isSwept, type Side, swept } from "../model/profiles";
import { type Group, type Node, type Part, isGroup, leaves, poses } from "../model/tree";

const literal = (value: number): string => {
  const text = String(Math.fround(value)).length < 12 ? String(Math.fround(value)) : Math.fround(value).toPrecision(9);
  return /[.e]/.test(text) ? text : `${text}.0`;
};
const numbers = (values: number[]): string => values.map(literal).join(", ");

export function toGlsl(root: Group): string {
  const rows: string[] = [];
  const functions: string[] = [];
  let groups = 0;
  const constant = (part: Part, copy: number): string => {
    const name = `PART_${rows.length}`;
    const pose = poses(part)[copy];
    const [w, x, y, z] = pose.rotation;
    const place = `vec3(${numbers(pose.translation)}), vec4(${numbers([x, y, z, w])})`;
    const profile = swept(part.field);
    if (profile) {
      const stem = `swept_${rows.length}`;
      const end = [Math.sin(profile.angle), Math.cos(profile.angle)];
      const body = [`float ${stem}(vec3 p) {  // ${comment(part.name)}`, `    vec3 v = into_frame(p, ${place});`];
      functions.push(planar(`${stem}_profile`, profile.sides, !profile.turned));
      if (!profile.turned) {
        const up = `v.z + ${literal(profile.height / 2)}`;
        const flat = `${stem}_profile(v.xy), ${up}, ${literal(profile.height)}`;
        if (hasRims(profile)) body.push(`    return extruded_with_rims(${flat}, vec4(${numbers(profile.rims)}));`);
        else body.push(`    return extruded(${flat}, vec2(${numbers(end)}));`);
      } else {
        const side = `${stem}_profile(vec2(length(v.xy), v.z))`;
        const [s, c] = end.map(literal);
        if (profile.angle <= 6.2831) functions.push(planar(`${stem}_end`, profile.sides, true));
        const first = `vec2(${stem}_end(v.xz), v.y)`;
        const last = `vec2(${stem}_end(vec2(${c} * v.x + ${s} * v.y, v.z)), ${c} * v.y - ${s} * v.x)`;
        const whole = profile.angle > 6.2831;
        body.push(`    return ${whole ? side : `turned_partly(${side}, ${first}, ${last}, v.xy, ${literal(profile.angle)})`};`);
      }
      functions.push([...body, "}", ""].join("\n"));
      rows.push(`// ${comment(part.name)}: ${stem}`);
      return `${stem}(p)`;
    }
    const along = pipe(part.field);
    if (along) {
      const stem = `piped_${rows.length}`;
      const vec = (values: number[]) => `vec${values.length}(${numbers(values)})`;
      const [radii, near] = [vec([along.radius, along.bore || NO_BORE]), literal(along.near)];
      const pieces = along.pieces.map(({ at, way, out, size, angle }) =>
        out
          ? `pipe_bend(v, ${vec(at)}, ${vec(out)}, ${vec(way)}, ${vec([size, Math.cos(angle), Math.sin(angle)])}, ${near}, square);`
          : `pipe_run(v, ${vec(at)}, ${vec(way)}, ${literal(size)}, ${near}, square);`,
      );
      const ends = along.ends.map(([middle, out]) => `pipe_end(v, ${vec(middle)}, ${vec(out)}, ${radii})`);
      const body = [`vec3 v = into_frame(p, ${place});`, "float square = 1e30;", ...pieces, `return pipe(square, ${radii}, ${ends.join(", ")});`];
      functions.push([`float ${stem}(vec3 p) {  // ${comment(part.name)}`, ...body.map((line) => `    ${line}`), "}", ""].join("\n"));
      rows.push(`// ${comment(part.name)}: ${stem}`);
      return `${stem}(p)`;
    }
    const surface = quadric(part.field);
    if (surface) {
      const s = surface.square;
      const rest = `mat3(${numbers(s.flat())}), vec3(${numbers(surface.linear)}), ${numbers([surface.constant, surface.fall, surface.rise, part.blend])}`;
      rows.push(`const Quadric ${name} = Quadric(${place}, ${rest});  // ${comment(part.name)}`);
      return `quadric_sdf(p, ${name})`;
    }
    const [sx, sy, sz, ...own] = superfrustum(part.field)!;
    rows.push(`const Part ${name} = Part(${place}, vec3(${numbers([sx, sy, sz])}), ${numbers([...own, part.blend])});  // ${comment(part.name)}`);
    return `part_sdf(p, ${name})`;
  };
  const call = (node: Node): string => {
    if (!isGroup(node) && !node.instances.length) return constant(node, 0);
    const name = `group_${++groups}`;
    write(node, name);
    return `${name}(p)`;
  };
  const write = (node: Node, name: string): void => {
    const terms: [string, number][] = [];
    if (!isGroup(node)) for (let i = 0; i <= node.instances.length; i++) terms.push([constant(node, i), node.blend]);
    else
      for (const child of node.children) {
        if (!isGroup(child) && node.operation === "union")
          for (let i = 0; i <= child.instances.length; i++) terms.push([constant(child, i), child.blend]);
        else terms.push([call(child), child.blend]);
      }
    const operation = isGroup(node) ? node.operation : "union";
    const [first, ...others] = terms;
    const lines = others.map(([term, blend]) => `    d = smooth_${operation}(d, ${term}, ${literal(blend)});`);
    functions.push([`float ${name}(vec3 p) {`, `    float d = ${first[0]};`, ...lines, "    return d;", "}", ""].join("\n"));
  };
  write(root, "sdf");
  const parts = [...leaves(root)];
  return [
    `// ${comment(root.name) || "Assembly"}: ${parts.length} parts. Lengths in ${root.unit ?? "an unknown unit"}.`,
    "// float sdf(vec3 p) is the signed distance, negative inside. Put it after `#version 330` or later,",
    "// or after `#version 300 es` and `precision highp float;`.",
    "",
    distanceFormula,
    superfrustumFormula,
    ...(parts.some((part) => part.field.kind === "quadric") ? [quadricFormula] : []),
    ...(parts.some((part) => isSwept(part.field)) ? [profileFormula] : []),
    ...(parts.some((part) => isPipe(part.field)) ? [pipeFormula] : []),
    ...rows,
    "",
    ...functions,
  ].join("\n");
}

/** The function of a profile's signed distance; axis: whether sides on the axis count. */
function planar(name: string, sides: Side[], axis: boolean): string {
  const vec = (values: number[]) => `vec${values.length}(${numbers(values)})`;
  const lines = sides
    .filter((side) => axis || !side.onAxis)
    .flatMap((side) => {
      const ends = `${vec(side.start)}, ${vec(side.end)}`;
      if (side.radius === 0) return [`profile_line(p, ${ends}, square, inside);`];
      const circle = `${vec(side.centre)}, ${literal(side.radius)}`;
      const pieces = side.pieces.map(
        ([low, high, right]) => `profile_piece(p, ${vec([low, high])}, ${circle}, ${right ? "true" : "false"}, inside);`,
      );
      return [`profile_arc(p, ${ends}, ${circle}, ${vec([...side.middle, side.cosine])}, square);`, ...pieces];
    });
  const head = [`float ${name}(vec2 p) {`, "    float square = 1e30;", "    bool inside = false;"];
  return [...head, ...lines.map((line) => `    ${line}`), "    return inside ? -sqrt(square) : sqrt(square);", "}", ""].join("\n");
}

const comment = (name: string): string => name.replace(/[^\x20-\x7e]|\\/g, "_");
