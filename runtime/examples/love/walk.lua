-- walk.lua: a walk as `clamor render --walk` takes it, to the last bit of each pose.
--
-- Positions and angles are linear between points, yaw and roll along the shorter arc. The arithmetic
-- is that of the program in the same order, so that both render the same samples.
local json = require "json"

local Walk = {}
Walk.__index = Walk

local sin, cos, pi = math.sin, math.cos, math.pi

function Walk.read(path)
  local walk = json.read(path)
  assert(walk.points and walk.points[1], path .. ": needs a list of points")
  for _, point in ipairs(walk.points) do
    for _, angle in ipairs {"yaw", "pitch", "roll"} do
      point[angle] = (point[angle .. "_deg"] or 0) * (pi / 180)
    end
  end
  return setmetatable(walk, Walk)
end

function Walk:length_s()
  return self.points[#self.points].time_s
end

-- The shorter turn from one angle to another: IEEE's remainder of their difference.
local function shortest_turn(from, to)
  local turn = math.fmod(to - from, 2 * pi)
  if turn > pi then return turn - 2 * pi end
  return turn < -pi and turn + 2 * pi or turn
end

local function multiply(ax, ay, az, aw, bx, by, bz, bw)
  return aw * bx + ax * bw + ay * bz - az * by, aw * by + ay * bw + az * bx - ax * bz,
    aw * bz + az * bw + ax * by - ay * bx, aw * bw - ax * bx - ay * by - az * bz
end

-- The quaternion of a head: yaw grows to the left, pitch upwards, roll to the right shoulder.
function Walk.orientation(yaw, pitch, roll)
  local x, y, z, w = multiply(0, sin(yaw * 0.5), 0, cos(yaw * 0.5),
    sin(pitch * 0.5), 0, 0, cos(pitch * 0.5))
  return multiply(x, y, z, w, 0, 0, -sin(roll * 0.5), cos(roll * 0.5))
end

-- x, y, z, yaw, pitch, roll at a time.
function Walk:at(time_s)
  local points = self.points
  if self.loop and self:length_s() > 0 then
    time_s = math.fmod(math.max(time_s, 0), self:length_s())
  end
  local after = 1
  while points[after] and time_s >= points[after].time_s do after = after + 1 end
  local a, b = points[math.max(after - 1, 1)], points[math.min(after, #points)]
  local from, to = a.position_m, b.position_m
  if a == b or after == 1 then
    a = after == 1 and points[1] or points[#points]
    return a.position_m[1], a.position_m[2], a.position_m[3], a.yaw, a.pitch, a.roll
  end
  local t = (time_s - a.time_s) / (b.time_s - a.time_s)
  return from[1] + t * (to[1] - from[1]), from[2] + t * (to[2] - from[2]),
    from[3] + t * (to[3] - from[3]), a.yaw + t * shortest_turn(a.yaw, b.yaw),
    a.pitch + t * (b.pitch - a.pitch), a.roll + t * shortest_turn(a.roll, b.roll)
end

return Walk
