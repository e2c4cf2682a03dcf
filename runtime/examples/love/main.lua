-- main.lua: walks through baked levels and plays what is heard there: love FOLDER BAKE... [options].
local source = love.filesystem.getSource()
local LevelMap = require "level_map"
local View = require "view"
local Walk = require "walk"
local Hearing = require "hearing"

local USAGE = [[
love runtime/examples/love BAKE.clamor... [options]

Walks through levels that `clamor bake` has baked. The map is NAME.glb beside NAME.clamor, or in the
folder of --levels.

  --levels FOLDER    where the levels are [this repository's assets/levels]
  --walk WALK.json   follow a walk, as `clamor play --walk` does
  --record OUT.wav   with --walk: record it, as `clamor render --limiter on --walk` does, and end
  --screenshot PNG   save a picture of the last frame of a recording

example: love runtime/examples/love build/demo/violin_room.clamor build/demo/stadium.clamor
]]

-- Where a walker begins, and how a level is heard and drawn. Others take the values of `any`.
local LEVELS = {
  any = {start = {0, 0}, cut_above_m = 0},
  violin_room = {title = "Violin room", start = {0, 3}, cut_above_m = 0},
  -- A crowd needs more voices than a room. The cut is below the roof.
  stadium = {title = "Stadium", start = {0, 0}, cut_above_m = 16, voices = 6000},
}
local EYES_M, RADIUS_M, WALK_MPS, RUN_MPS, TURN_RADPS = 1.7, 0.25, 1.4, 4.5, 1.8

local options = {bakes = {}, levels = source .. "/../../../assets/levels"}
local hearing, walk, view, map, title
local number, entering -- of the bakes that are heard, and opened
local walker = {x = 0, y = EYES_M, z = 0, yaw = 0, pitch = 0, roll = 0, floor = 0}
local message, failed = "Listen with headphones.", false

local function usage(complaint)
  io.stderr:write(complaint, "\n\n", USAGE)
  os.exit(2)
end

local function read_arguments(words)
  local i = 1
  while words[i] do
    local name = words[i]:match("^%-%-(%a+)$")
    if not name then
      options.bakes[#options.bakes + 1] = words[i]
    elseif name == "help" then
      io.write(USAGE)
      os.exit(0)
    elseif ("levels walk record screenshot"):find(name, 1, true) and words[i + 1] then
      i = i + 1
      options[name] = words[i]
    else
      usage("there is no option " .. words[i] .. ", or its value is missing")
    end
    i = i + 1
  end
  if #options.bakes == 0 then usage("which bake?") end
  if options.record and not options.walk then usage("--record needs a walk to follow") end
end

local function name_of(bake)
  return bake:match("([^/]*)%.clamor$") or usage(bake .. ": is not named NAME.clamor")
end

-- Draws another level from now on.
local function show(index)
  local bake = options.bakes[index]
  local name, beside = name_of(bake), bake:gsub("%.clamor$", ".glb")
  local file = io.open(beside, "rb")
  if file then file:close() end
  map = LevelMap.read(file and beside or options.levels .. "/" .. name .. ".glb")
  view = View.new(map)
  local level = LEVELS[name] or LEVELS.any
  number = index
  walker.x, walker.z, walker.floor = level.start[1], level.start[2], 0
  walker.y, walker.yaw, walker.cut_above_m = EYES_M, 0, level.cut_above_m
  title = level.title or name
  love.window.setTitle("Clamor: " .. title)
end

function love.load(words)
  read_arguments(words)
  if options.walk then walk = Walk.read(options.walk) end
  show(1)
  -- A listener has as many voices as the largest level needs, since it goes from one to the other.
  local voices
  for _, bake in ipairs(options.bakes) do
    voices = (LEVELS[name_of(bake)] or LEVELS.any).voices or voices
  end
  local opened, failure = Hearing.open(options.bakes[1], {voices = voices, record = options.record,
    seconds = walk and walk:length_s()})
  if not opened then
    io.stderr:write(failure, "\n")
    os.exit(1)
  end
  hearing = opened
  if walk then message = "Following " .. options.walk:match("[^/]*$") end
  love.mouse.setRelativeMode(walk == nil)
end

-- ---- Walking ------------------------------------------------------------------------------------

local function held(...)
  return love.keyboard.isDown(...) and 1 or 0
end

local function step(dt)
  walker.yaw = walker.yaw + TURN_RADPS * dt * (held("left") - held("right"))
  local ahead, aside = held("w", "up") - held("s", "down"), held("d") - held("a")
  local speed = love.keyboard.isDown("lshift", "rshift") and RUN_MPS or WALK_MPS
  local length = math.sqrt(ahead * ahead + aside * aside)
  if length > 0 then
    local sin, cos = math.sin(walker.yaw), math.cos(walker.yaw)
    local dx = (aside * cos - ahead * sin) / length * speed * dt
    local dz = (-aside * sin - ahead * cos) / length * speed * dt
    local walls = map:cut(walker.floor + 1)
    -- Along a wall, one of the axes is free.
    for _, way in ipairs {{dx, dz}, {dx, 0}, {0, dz}} do
      local x, z = walker.x + way[1], walker.z + way[2]
      local floor = map:floor(x, z, walker.floor)
      if floor and LevelMap.is_free(walls, walker.x, walker.z, x, z, RADIUS_M) then
        walker.x, walker.z, walker.floor = x, z, floor
        break
      end
    end
  end
  walker.y = walker.y + (walker.floor + EYES_M - walker.y) * math.min(1, 8 * dt)
end

-- Where the walker is at a time of the sound: on the walk, or where the keys led.
local function pose_at(time_s)
  if walk then
    walker.x, walker.y, walker.z, walker.yaw, walker.pitch, walker.roll = walk:at(time_s)
  end
  return walker.x, walker.y, walker.z, Walk.orientation(walker.yaw, walker.pitch, walker.roll)
end

-- Draws the level that was being opened, once it is heard.
local function finish_entering()
  local answer = hearing:entered()
  if answer == nil then return end
  failed = answer ~= true
  message = failed and answer or "Listen with headphones."
  if not failed then show(entering) end
  entering = nil
end

function love.update(dt)
  finish_entering()
  if not walk then step(math.min(dt, 0.1)) end
  hearing:play(pose_at)
  if hearing:is_over() and not options.screenshot then love.event.quit() end
end

function love.draw()
  view:draw(walker, {title = title, message = message, failed = failed,
    statistics = hearing.ears:statistics(), peaks = hearing.peaks, time_s = hearing:time_s(),
    other_levels = #options.bakes > 1})
  if hearing:is_over() and options.screenshot then
    love.graphics.captureScreenshot(function(picture)
      local file = assert(io.open(options.screenshot, "wb"))
      file:write(picture:encode("png"):getString())
      file:close()
      love.event.quit()
    end)
  end
end

-- ---- Input --------------------------------------------------------------------------------------

function love.mousemoved(_, _, dx)
  if not walk then walker.yaw = walker.yaw - 0.003 * dx end
end

function love.wheelmoved(_, turned)
  view:wheel(turned)
end

function love.keypressed(key)
  local index = tonumber(key)
  if key == "escape" then
    love.event.quit()
  elseif key == "pageup" or key == "pagedown" then
    walker.cut_above_m = walker.cut_above_m + (key == "pageup" and 0.5 or -0.5)
  elseif index and options.bakes[index] and index ~= number and not walk and not entering then
    hearing:enter(options.bakes[index])
    entering, message, failed = index, "Opening " .. name_of(options.bakes[index]) .. " ...", false
  end
end

-- A recording ends with an error, where LÖVE would show it until a key is pressed.
local show_error = love.errorhandler
function love.errorhandler(words)
  if not options.record then return show_error(words) end
  io.stderr:write(debug.traceback(tostring(words), 2), "\n")
  os.exit(1)
end

function love.quit()
  if hearing then hearing:close() end
end
