"use strict";
// data.js: the level that C++ wrote into the page (view_json.cpp), as typed arrays.

function bytesOf(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64).buffer;  // ten times as fast
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}
const floats = (base64) => new Float32Array(bytesOf(base64));
const words = (base64) => new Uint16Array(bytesOf(base64));

function readLevel(level) {
  const mesh = level.mesh, sources = level.sources;
  mesh.vertices = words(mesh.vertices);
  mesh.materials = words(mesh.materials);
  mesh.corners = mesh.corners32 !== undefined ? new Uint32Array(bytesOf(mesh.corners32)) : words(mesh.corners16);
  mesh.positions = new Float32Array(mesh.vertices.length);  // metres
  for (let i = 0; i < mesh.vertices.length; ++i)
    mesh.positions[i] = mesh.low[i % 3] + mesh.vertices[i] / 65535 * mesh.size[i % 3];
  for (const name of ["places", "delays"]) sources[name] = floats(sources[name]);
  for (const name of ["materials", "kinds"]) sources[name] = words(sources[name]);
  const steps = new Uint8Array(bytesOf(sources.powers));
  sources.powers = new Float64Array(steps.length);
  for (let i = 0; i < steps.length; ++i)
    sources.powers[i] = steps[i] === 255 ? 0 : sources.top * 10 ** (-steps[i] / 20);
  level.emitters.places = floats(level.emitters.places);
  level.emitters.kinds = words(level.emitters.kinds);
  level.nodes.boxes = floats(level.nodes.boxes ?? "");
  level.nodes.of = new Uint8Array(bytesOf(level.nodes.of ?? ""));
  level.probes.places = floats(level.probes.places);
  level.probes.zones = words(level.probes.zones);
  return level;
}
