-- json.lua: reads JSON, as walks and glTF levels are written in it.
local json = {}

local escapes = {b = "\b", f = "\f", n = "\n", r = "\r", t = "\t"}
local words = {["true"] = true, ["false"] = false}

local read_value -- (text, at): the value and where what follows it begins

local function after_space(text, at)
  return text:find("%S", at) or #text + 1
end

local function read_string(text, at)
  local ends = at + 1
  while true do
    ends = assert(text:find('["\\]', ends), "a string does not end")
    if text:sub(ends, ends) == '"' then break end
    ends = ends + 2
  end
  -- Names in other alphabets are not shown, so a question mark stands for them.
  local content = text:sub(at + 1, ends - 1):gsub("\\u%x%x%x%x", "?")
  return content:gsub("\\(.)", function(c) return escapes[c] or c end), ends + 1
end

-- Reads what is between brackets: `read_item` reads an item into the list, and where it ends.
local function read_items(text, at, closing, read_item)
  local items = {}
  at = after_space(text, at + 1)
  while text:sub(at, at) ~= closing do
    at = after_space(text, read_item(items, at))
    local separator = text:sub(at, at)
    if separator == "," then
      at = after_space(text, at + 1)
    elseif separator ~= closing then
      error("a list lacks its comma at byte " .. at)
    end
  end
  return items, at + 1
end

function read_value(text, at)
  at = after_space(text, at)
  local first = text:sub(at, at)
  if first == '"' then return read_string(text, at) end
  if first == "[" then
    return read_items(text, at, "]", function(items, from)
      local value, next_at = read_value(text, from)
      items[#items + 1] = value
      return next_at
    end)
  elseif first == "{" then
    return read_items(text, at, "}", function(items, from)
      local key, colon = read_string(text, from)
      local value, next_at = read_value(text, after_space(text, colon) + 1)
      items[key] = value
      return next_at
    end)
  end
  local word = assert(text:match("^[%w+.-]+", at), "no value at byte " .. at)
  local value = words[word]
  if value == nil and word ~= "null" then
    value = assert(tonumber(word), "no value at byte " .. at)
  end
  return value, at + #word
end

function json.decode(text)
  return (read_value(text, 1))
end

function json.read(path)
  local file = assert(io.open(path, "rb"))
  local text = file:read("*a")
  file:close()
  return json.decode(text)
end

return json
