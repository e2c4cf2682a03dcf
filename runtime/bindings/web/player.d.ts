// player.d.ts: types of player.js. Positions are metres in glTF's frame, orientations quaternions x, y, z, w.
export type Vector = [number, number, number] | number[];
export type Quaternion = [number, number, number, number] | number[];

export interface ContextOptions {
  worker?: Worker;
  urls?: {worklet?: string | URL; wasm?: string | URL};
  wasm?: ArrayBuffer | Uint8Array;
  onlog?: (sentence: string) => void;
  max_sources?: number;
  max_sounds?: number;
}

export interface ListenerOptions {
  position_m?: Vector;
  orientation?: Quaternion;
  output?: "binaural" | "loudspeakers" | "ambisonics" | "receivers";
  layout?: string;
  voices?: number;
  gain?: number;
  limits?: 0 | 1;
  memory_bytes?: bigint;
  lead_s?: number;
  reports_voices?: 0 | 1;
}

export interface SourceOptions {
  position_m?: Vector;
  velocity_mps?: Vector;
  axis?: Vector;
  gain?: number;
  band_gains?: number[];
  directivity?: number[];
  reverberation?: number;
}

export interface Statistics {
  voices: number;
  keyframes: bigint;
  held_blocks: bigint;
  keyframe_ms: number;
  pages: bigint;
  page_bytes: bigint;
  sound_bytes: bigint;
  failures: bigint;
  unseen_sources: number;
  missed: number;
}

// `direction` is x right, y up, -z ahead of the listener.
export interface Voice {
  slot: number;
  starts: number;
  sound: bigint;
  level_sound: number;
  direction: number[];
  delay_s: number;
  band_gains: number[];
}

export class ClamorContext {
  static create(audio: BaseAudioContext, options?: ContextOptions): Promise<ClamorContext>;
  readonly audio: BaseAudioContext;
  open(source: string | ArrayBuffer, name?: string): Promise<ClamorLevel>;
  listen(level: ClamorLevel, options?: ListenerOptions): Promise<ClamorListener>;
  addSound(buffer: AudioBuffer | Float32Array, options?: {rate_hz?: number; loops?: boolean}): Promise<bigint>;
  addSource(sound: bigint | AudioNode, options?: SourceOptions): Promise<ClamorSource>;
  close(): void;
}

export interface ClamorLevel {
  readonly info: {emitters: number; sounds: number; portals: number; sources: bigint; parts: number};
  readonly emitters: {name: string; sound: number; position_m: number[]; gain: number}[];
  readonly portals: {name: string; centre_m: number[]; half_u_m: number[]; half_v_m: number[]}[];
  readonly parts: {name: string; triangles: number}[];
  changeEmitter(emitter: number | string, change: {gain?: number; is_muted?: boolean}): void;
  setPortal(portal: number | string, openness: number): void;
  movePart(part: number | string, position_m: Vector, orientation?: Quaternion): void;
  close(): void;
}

export interface ClamorListener {
  readonly node: AudioWorkletNode;
  readonly channels: number;
  readonly latency_s: number;
  connect(destination: AudioNode, output?: number, input?: number): AudioNode;
  disconnect(): void;
  move(position_m: Vector, orientation?: Quaternion): void;
  enter(level: ClamorLevel): Promise<void>;
  prepare(seconds: number, poses?: {time_s: number; position_m: Vector; orientation: Quaternion}[]): Promise<void>;
  statistics(): Promise<Statistics>;
  voices(): Promise<Voice[]>;
  close(): void;
}

export interface ClamorSource {
  move(position_m: Vector, velocity_mps?: Vector, axis?: Vector): void;
  change(options: SourceOptions): void;
  close(): void;
}
