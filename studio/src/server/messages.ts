/** Made by `python -m partwright.studio.messages`: change them there. */

export interface Step {
  label: string;
  text: string;
}

export interface Image {
  name: string;
  data: string;
}

export interface Size {
  parts: number;
  iou: number;
  text: string;
}

export interface Tried {
  number: number;
  value: number;
  kept: boolean;
}

export interface Commit {
  type: "commit";
  base: number;
  label: string;
  text: string;
}

export interface Undo {
  type: "undo";
  base: number;
}

export interface Redo {
  type: "redo";
  base: number;
}

export interface Fit {
  type: "fit";
  mode: "new" | "only" | "except";
  names: string[];
  method: string;
  quality: "draft" | "normal" | "high";
  max_parts?: number | null;
  curve?: boolean;
}

export interface Reshape {
  type: "reshape";
  action: "split" | "merge" | "box";
  names: string[];
  method: string;
  quality: "draft" | "normal" | "high";
  box?: number[];
}

export interface Bake {
  type: "bake";
  size: number;
}

export interface Learned {
  type: "learned";
  action: "resample" | "swap";
  name: string;
  seed?: number;
  source?: string;
}

export interface Improve {
  type: "improve";
  goal: string;
  axis: "x" | "y" | "z" | "-x" | "-y" | "-z";
  locked: string[];
  steps: number;
  walls?: number;
  volume?: number;
}

export interface Stop {
  type: "stop";
}

export interface Save {
  type: "save";
}

export interface State {
  type: "state";
  revision: number;
  text: string;
  past: Step[];
  future: Step[];
  images: Image[];
  file: string;
  saved: boolean;
  input: string;
  coloured: boolean;
  box: number[];
  unit: string;
  up: string;
  methods: string[];
  donors: string[];
  goals: string[];
  formats: string[];
  format_names: string[];
  fitting: boolean;
  note: string;
}

export interface Accepted {
  type: "accepted";
  revision: number;
}

export interface Unkept {
  type: "unkept";
  message: string;
}

export interface Fitting {
  type: "fitting";
  stage: string;
  fraction: number;
  parts: number;
  iou: number;
  text: string;
}

export interface Fitted {
  type: "fitted";
  outcome: string;
  parts: number;
  iou: number;
}

export interface Curve {
  type: "curve";
  sizes: Size[];
  of: string;
}

export interface Improving {
  type: "improving";
  goal: string;
  of: number;
  tried: Tried[];
}

export interface Scored {
  type: "scored";
  revision: number;
  iou: number;
  chamfer: number;
  max_deviation: number;
  deviation_95: number;
  overlap: number;
}

export interface Saved {
  type: "saved";
  file: string;
}

export interface Failed {
  type: "failed";
  message: string;
}

export type FromPage = Commit | Undo | Redo | Fit | Reshape | Bake | Learned | Improve | Stop | Save;
export type FromServer = State | Accepted | Unkept | Fitting | Fitted | Curve | Improving | Scored | Saved | Failed;
