-- level_map.lua: what a map shows of a glTF level: its triangles, its sound emitters, and a cut
-- through its walls. Clamor itself needs none of this: it plays the bake.
local ffi = require "ffi"
local json = require "json"

local LevelMap = {}
LevelMap.__index = LevelMap

local WIDTHS = {SCALAR = 1, VEC2 = 2, VEC3 = 3, VEC4 = 4}
local TYPES = {[5121] = "const uint8_t*", [5122] = "const int16_t*", [5123] = "const uint16_t*",
  [5125] = "const uint32_t*", [5126] = "const float*"}
local STEP_M = 0.45 -- the highest step that a walker takes

-- ---- Reading ------------------------------------------------------------------------------------

local function little_endian(text, at)
  local a, b, c, d = text:byte(at, at + 3)
  return a + 256 * (b + 256 * (c + 256 * d))
end

local function read_glb(path)
  local file = assert(io.open(path, "rb"))
  local text = file:read("*a")
  file:close()
  assert(text:sub(1, 4) == "glTF", path .. ": is not a .glb file")
  local json_bytes = little_endian(text, 13)
  return json.decode(text:sub(21, 20 + json_bytes)), text:sub(29 + json_bytes)
end

-- The values of an accessor as a pointer into `bytes`, their number and how many each has.
local function values_of(gltf, bytes, index)
  local accessor = gltf.accessors[index + 1]
  local view = gltf.bufferViews[accessor.bufferView + 1]
  assert(not view.byteStride, "interleaved buffers are not read here")
  local start = ffi.cast("const char*", bytes) + (view.byteOffset or 0) + (accessor.byteOffset or 0)
  return ffi.cast(TYPES[accessor.componentType], start), accessor.count, WIDTHS[accessor.type]
end

-- A transform is a list of twelve: three rows of a rotation with scale, and the translation.
local function transform_of(t, r, s)
  local x, y, z, w = r[1], r[2], r[3], r[4]
  return {s[1] * (1 - 2 * (y * y + z * z)), s[2] * 2 * (x * y - z * w), s[3] * 2 * (x * z + y * w),
    s[1] * 2 * (x * y + z * w), s[2] * (1 - 2 * (x * x + z * z)), s[3] * 2 * (y * z - x * w),
    s[1] * 2 * (x * z - y * w), s[2] * 2 * (y * z + x * w), s[3] * (1 - 2 * (x * x + y * y)),
    t[1], t[2], t[3]}
end

local function apply(m, x, y, z)
  return m[1] * x + m[2] * y + m[3] * z + m[10], m[4] * x + m[5] * y + m[6] * z + m[11],
    m[7] * x + m[8] * y + m[9] * z + m[12]
end

local function multiply(a, b)
  local c = {}
  for row = 0, 6, 3 do
    for column = 1, 3 do
      c[row + column] = a[row + 1] * b[column] + a[row + 2] * b[3 + column] +
        a[row + 3] * b[6 + column]
    end
  end
  c[10], c[11], c[12] = apply(a, b[10], b[11], b[12])
  return c
end

local function add_mesh(map, gltf, bytes, mesh, transform)
  for _, primitive in ipairs(mesh.primitives) do
    local at = values_of(gltf, bytes, primitive.attributes.POSITION)
    local indices, count = values_of(gltf, bytes, primitive.indices)
    local material = gltf.materials[(primitive.material or 0) + 1]
    local colour = material.pbrMetallicRoughness.baseColorFactor or {1, 1, 1, 1}
    for i = 0, count - 3, 3 do
      local triangle = {colour = colour}
      for corner = 0, 2 do
        local v = 3 * indices[i + corner]
        local x, y, z = apply(transform, at[v], at[v + 1], at[v + 2])
        triangle[3 * corner + 1], triangle[3 * corner + 2], triangle[3 * corner + 3] = x, y, z
      end
      map.triangles[#map.triangles + 1] = triangle
    end
  end
end

-- Adds the emitters of a node: one, or one for each of its instances.
local function add_emitters(map, gltf, bytes, node, transform)
  local extensions = node.extensions
  local which = extensions.KHR_audio_emitter.emitters or {extensions.KHR_audio_emitter.emitter}
  local all = gltf.extensions.KHR_audio_emitter.emitters
  -- Takes of a sound are numbered; a map shows them as one kind.
  local kind = (all[which[1] + 1].name or node.name or "emitter"):gsub("^fans_", "")
    :gsub("_%d+$", ""):gsub("_", " ")
  local instancing = extensions.EXT_mesh_gpu_instancing
  if not map.kinds[kind] then
    map.kinds[kind] = {}
    map.kinds[#map.kinds + 1] = kind
  end
  local list = map.kinds[kind]
  if not instancing then
    list[#list + 1] = {transform[10], transform[12], transform[11]}
    return
  end
  local at, count = values_of(gltf, bytes, instancing.attributes.TRANSLATION)
  for i = 0, count - 1 do
    local x, y, z = apply(transform, at[3 * i], at[3 * i + 1], at[3 * i + 2])
    list[#list + 1] = {x, z, y}
  end
end

local function add_node(map, gltf, bytes, index, above)
  local node = gltf.nodes[index + 1]
  local extensions = node.extensions or {}
  local transform = multiply(above, transform_of(node.translation or {0, 0, 0},
    node.rotation or {0, 0, 0, 1}, node.scale or {1, 1, 1}))
  if extensions.KHR_audio_emitter then add_emitters(map, gltf, bytes, node, transform) end
  if node.mesh and not extensions.EXT_mesh_gpu_instancing then
    add_mesh(map, gltf, bytes, gltf.meshes[node.mesh + 1], transform)
  end
  for _, child in ipairs(node.children or {}) do add_node(map, gltf, bytes, child, transform) end
end

-- Reads a .glb file. The map has `triangles` (nine coordinates and a colour each), `kinds` (names,
-- and for each name a list of emitters {x, z, y}), and the bounds min_x, max_x, min_z, max_z.
function LevelMap.read(path)
  local gltf, bytes = read_glb(path)
  local map = setmetatable({triangles = {}, kinds = {}, cuts = {}}, LevelMap)
  local identity = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}
  for _, index in ipairs(gltf.scenes[(gltf.scene or 0) + 1].nodes) do
    add_node(map, gltf, bytes, index, identity)
  end
  map.min_x, map.max_x, map.min_z, map.max_z = math.huge, -math.huge, math.huge, -math.huge
  for _, t in ipairs(map.triangles) do
    t.low, t.high = math.min(t[2], t[5], t[8]), math.max(t[2], t[5], t[8])
    t.left, t.right = math.min(t[1], t[4], t[7]), math.max(t[1], t[4], t[7])
    t.back, t.front = math.min(t[3], t[6], t[9]), math.max(t[3], t[6], t[9])
    map.min_x, map.max_x = math.min(map.min_x, t.left), math.max(map.max_x, t.right)
    map.min_z, map.max_z = math.min(map.min_z, t.back), math.max(map.max_z, t.front)
  end
  return map
end

-- ---- Walking ------------------------------------------------------------------------------------

-- The lines, {x1, z1, x2, z2}, where a horizontal plane cuts the triangles.
function LevelMap:cut(height_m)
  local key = math.floor(height_m * 10 + 0.5)
  if self.cuts.key == key then return self.cuts.lines end
  local lines, y = {}, key / 10 + 0.003 -- which no floor lies at
  for _, t in ipairs(self.triangles) do
    if t.low < y and t.high > y then
      local ends = {}
      for corner = 1, 7, 3 do
        local other = corner % 9 + 3 > 9 and 1 or corner + 3
        local a, b = t[corner + 1], t[other + 1]
        if (a < y) ~= (b < y) then
          local f = (y - a) / (b - a)
          ends[#ends + 1] = t[corner] + f * (t[other] - t[corner])
          ends[#ends + 1] = t[corner + 2] + f * (t[other + 2] - t[corner + 2])
        end
      end
      if #ends == 4 then lines[#lines + 1] = ends end
    end
  end
  self.cuts = {key = key, lines = lines}
  return lines
end

-- The floor at a place: the highest surface that is no more than a step above `floor_m`.
function LevelMap:floor(x, z, floor_m)
  local best
  for _, t in ipairs(self.triangles) do
    if x >= t.left and x <= t.right and z >= t.back and z <= t.front and
      t.low <= floor_m + STEP_M then
      local abx, abz, acx, acz = t[4] - t[1], t[6] - t[3], t[7] - t[1], t[9] - t[3]
      local area = abx * acz - abz * acx
      if math.abs(area) > 1e-9 then
        local u = ((x - t[1]) * acz - (z - t[3]) * acx) / area
        local v = (abx * (z - t[3]) - abz * (x - t[1])) / area
        local y = t[2] + u * (t[5] - t[2]) + v * (t[8] - t[2])
        if u >= 0 and v >= 0 and u + v <= 1 and y <= floor_m + STEP_M and
          y > (best or -math.huge) then
          best = y
        end
      end
    end
  end
  return best
end

local function square_to_line(x, z, line)
  local ux, uz = line[3] - line[1], line[4] - line[2]
  local f = ((x - line[1]) * ux + (z - line[2]) * uz) / math.max(ux * ux + uz * uz, 1e-12)
  f = math.max(0, math.min(1, f))
  local dx, dz = line[1] + f * ux - x, line[2] + f * uz - z
  return dx * dx + dz * dz
end

-- Whether a walker may go from one place to another: nobody comes nearer than `radius_m` to a line.
function LevelMap.is_free(lines, from_x, from_z, x, z, radius_m)
  for _, line in ipairs(lines) do
    local square = square_to_line(x, z, line)
    if square < radius_m * radius_m and square < square_to_line(from_x, from_z, line) then
      return false
    end
  end
  return true
end

return LevelMap
