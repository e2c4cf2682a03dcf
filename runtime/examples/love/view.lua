-- view.lua: draws the map of a level from above, the walker in it, and what the library tells.
local View = {}
View.__index = View

local PANEL = 300 -- pixels, on the left
local INK, DIM, ACCENT = {0.92, 0.93, 0.95}, {0.58, 0.62, 0.68}, {1, 0.78, 0.35}
local BACKGROUND, PANEL_COLOUR = {0.075, 0.09, 0.115}, {0.105, 0.125, 0.155}

local KEYS = {{"W S", "walk"}, {"A D", "step aside"}, {"mouse, left right", "turn"},
  {"shift", "run"}, {"wheel", "zoom"}, {"page up, down", "cut higher, lower"}}

-- Surfaces above the cut are left out.
local CUT = [[
varying float height;
#ifdef VERTEX
attribute float Height;
vec4 position(mat4 transform, vec4 vertex) { height = Height; return transform * vertex; }
#endif
#ifdef PIXEL
extern float cut;
vec4 effect(vec4 color, Image image, vec2 at, vec2 pixel) { if (height > cut) discard; return color; }
#endif
]]

-- Fonts are made once for each size.
local fonts = {}
local function font(size)
  fonts[size] = fonts[size] or love.graphics.newFont(size)
  return fonts[size]
end

local function text(words, x, y, size, colour, width, align)
  love.graphics.setFont(font(size))
  love.graphics.setColor(colour)
  love.graphics.printf(words, math.floor(x), math.floor(y), width or PANEL - 48, align or "left")
end

-- ---- The map ------------------------------------------------------------------------------------

-- Light falls from the south west; colours of glTF are linear.
local function shade(t)
  local ax, ay, az, bx, by, bz = t[4] - t[1], t[5] - t[2], t[6] - t[3], t[7] - t[1], t[8] - t[2],
    t[9] - t[3]
  local nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
  local length = math.max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
  local light = 0.4 + 0.6 * math.abs(ny * 0.85 - nx * 0.35 + nz * 0.4) / length
  local c = t.colour
  return (c[1] * light) ^ (1 / 2.2), (c[2] * light) ^ (1 / 2.2), (c[3] * light) ^ (1 / 2.2)
end

local function mesh_of(map)
  local sorted = {}
  for i, t in ipairs(map.triangles) do sorted[i] = t end
  table.sort(sorted, function(a, b) return a.high < b.high end)
  local vertices = {}
  for _, t in ipairs(sorted) do
    local r, g, b = shade(t)
    for corner = 1, 7, 3 do
      vertices[#vertices + 1] = {t[corner], t[corner + 2], t[corner + 1], r, g, b, 1}
    end
  end
  return love.graphics.newMesh({{"VertexPosition", "float", 2}, {"Height", "float", 1},
    {"VertexColor", "float", 4}}, vertices, "triangles", "static")
end

-- A colour for each kind of emitter, around the wheel.
local function colour_of(index, count)
  if count == 1 then return ACCENT end
  local h = 6 * (index - 1) / count
  local function part(shift)
    local k = (shift + h) % 6
    return 1 - 0.75 * math.max(0, math.min(1, k < 3 and k - 1 or 5 - k))
  end
  return {part(3), part(1), part(5)}
end

function View.new(map)
  local view = setmetatable({map = map, mesh = mesh_of(map), zoom = 1,
    shader = love.graphics.newShader(CUT), emitters = {}}, View)
  for i, kind in ipairs(map.kinds) do
    view.emitters[i] = {name = kind, places = map.kinds[kind], colour = colour_of(i, #map.kinds)}
  end
  return view
end

-- Metres to pixels: a scale, and the place in the middle. A map that is larger than the window
-- follows the walker.
function View:camera(walker)
  local map, width, height = self.map, love.graphics.getWidth() - PANEL, love.graphics.getHeight()
  local fit = math.min(width / (map.max_x - map.min_x), height / (map.max_z - map.min_z)) * 0.94
  local scale = fit * self.zoom
  local function middle(low, high, at, pixels)
    local half = math.max(0, (high - low) / 2 - pixels / 2 / scale * 0.9)
    return math.max((low + high) / 2 - half, math.min((low + high) / 2 + half, at))
  end
  return scale, middle(map.min_x, map.max_x, walker.x, width),
    middle(map.min_z, map.max_z, walker.z, height), PANEL + width / 2, height / 2
end

function View:wheel(turned)
  self.zoom = math.max(1, math.min(20, self.zoom * 1.15 ^ turned))
end

local function draw_emitters(view, scale, time_s)
  local several = #view.emitters > 1
  for _, emitter in ipairs(view.emitters) do
    local r, g, b = unpack(emitter.colour)
    love.graphics.setColor(r, g, b, several and 0.75 or 1)
    if several then
      love.graphics.setPointSize(math.max(1.5, math.min(7, 0.4 * scale)))
      love.graphics.points(emitter.places)
    else
      for _, place in ipairs(emitter.places) do
        love.graphics.circle("fill", place[1], place[2], 6 / scale)
        for ring = 0, 2 do
          local grown = (time_s * 0.6 + ring / 3) % 1
          love.graphics.setColor(r, g, b, 0.8 * (1 - grown))
          love.graphics.circle("line", place[1], place[2], (8 + 34 * grown) / scale)
        end
      end
    end
  end
end

local function draw_walker(walker, scale)
  love.graphics.push()
  love.graphics.translate(walker.x, walker.z)
  love.graphics.rotate(-walker.yaw) -- yaw 0 looks along -Z, up on the map
  love.graphics.setColor(1, 1, 1, 0.13)
  love.graphics.arc("fill", 0, 0, 90 / scale, -math.pi / 2 - 0.6, -math.pi / 2 + 0.6)
  local r = 10 / scale
  love.graphics.setColor(0.04, 0.05, 0.07)
  love.graphics.circle("fill", 0, 0, 1.6 * r)
  love.graphics.setColor(0.45, 0.85, 1)
  love.graphics.polygon("fill", 0, -1.25 * r, 0.85 * r, 0.9 * r, 0, 0.45 * r, -0.85 * r, 0.9 * r)
  love.graphics.pop()
end

function View:draw_map(walker, time_s)
  local scale, x, z, centre_x, centre_y = self:camera(walker)
  love.graphics.setScissor(PANEL, 0, love.graphics.getWidth() - PANEL, love.graphics.getHeight())
  love.graphics.push()
  love.graphics.translate(centre_x, centre_y)
  love.graphics.scale(scale)
  love.graphics.translate(-x, -z)
  self.shader:send("cut", walker.y + walker.cut_above_m)
  love.graphics.setShader(self.shader)
  love.graphics.setColor(1, 1, 1)
  love.graphics.draw(self.mesh)
  love.graphics.setShader()
  love.graphics.setLineWidth(2.5 / scale)
  love.graphics.setColor(0.96, 0.97, 1, 0.9)
  for _, line in ipairs(self.map:cut(walker.y)) do love.graphics.line(line) end
  love.graphics.setLineWidth(1.5 / scale)
  draw_emitters(self, scale, time_s)
  draw_walker(walker, scale)
  love.graphics.pop()
  if #self.emitters == 1 then
    local place = self.emitters[1].places[1]
    text(self.emitters[1].name, centre_x + (place[1] - x) * scale - 60,
      centre_y + (place[2] - z) * scale + 42, 15, ACCENT, 120, "center")
  end
  love.graphics.setScissor()
end

-- ---- The panel ----------------------------------------------------------------------------------

local function draw_meter(name, peak, y)
  text(name, 24, y - 4, 13, DIM)
  local width, filled = PANEL - 72, math.max(0, 1 + 20 * math.log10(math.max(peak, 1e-6)) / 60)
  love.graphics.setColor(0.18, 0.21, 0.26)
  love.graphics.rectangle("fill", 48, y, width, 10, 3)
  love.graphics.setColor(ACCENT)
  love.graphics.rectangle("fill", 48, y, width * filled, 10, 3)
end

local function draw_pairs(rows, y, left)
  for _, row in ipairs(rows) do
    text(row[1], 24, y, 14, left and INK or DIM)
    text(row[2], 24, y, 14, left and DIM or INK, PANEL - 48, "right")
    y = y + 21
  end
  return y
end

function View:draw_kinds(y)
  local bottom = love.graphics.getHeight() - 24 - 21 * (#KEYS + 1) -- above the keys
  for _, emitter in ipairs(self.emitters) do
    if y + 16 > bottom then return end
    love.graphics.setColor(emitter.colour)
    love.graphics.circle("fill", 29, y + 8, 4)
    text(emitter.name, 42, y, 12, INK)
    text(tostring(#emitter.places), 24, y, 12, DIM, PANEL - 48, "right")
    y = y + 16
  end
end

-- told: title, message, statistics, peaks, mode, and whether other levels can be entered.
function View:draw_panel(walker, told)
  love.graphics.setColor(PANEL_COLOUR)
  love.graphics.rectangle("fill", 0, 0, PANEL, love.graphics.getHeight())
  text(told.title, 24, 22, 24, INK)
  text(told.message, 24, 54, 13, told.failed and {1, 0.5, 0.45} or DIM)
  draw_meter("L", told.peaks[1], 100)
  draw_meter("R", told.peaks[2], 118)
  local s, turned = told.statistics, (math.deg(walker.yaw) + 180) % 360 - 180
  local y = draw_pairs({
    {"position", ("%.1f, %.1f, %.1f m"):format(walker.x, walker.y, walker.z)},
    {"looks", ("%.0f° %s of north"):format(math.abs(turned), turned < 0 and "right" or "left")},
    {"voices", tostring(s.voices)},
    {"keyframe", ("%.1f ms"):format(s.keyframe_ms)},
    {"late blocks", tostring(s.held_blocks)},
    {"memory", ("%.1f MB"):format((s.page_bytes + s.sound_bytes) / 1e6)}}, 146)
  text("emitters", 24, y + 10, 14, DIM)
  self:draw_kinds(y + 33)
  local keys = told.other_levels and {{"1 2 ...", "enter another level"}} or {}
  for _, row in ipairs(KEYS) do keys[#keys + 1] = row end
  draw_pairs(keys, love.graphics.getHeight() - 24 - 21 * #keys, true)
end

function View:draw(walker, told)
  love.graphics.clear(BACKGROUND)
  self:draw_map(walker, told.time_s)
  self:draw_panel(walker, told)
end

return View
