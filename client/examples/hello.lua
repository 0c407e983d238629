-- The same as hello.cpp from another language: the whole protocol of a client on one page.
-- Lua 5.2 with Debian's liblcm-lua; the message types come from lcm-gen and lcmtypes/*.lcm:
--   lcm-gen --lua --lpath FOLDER lcmtypes/*.lcm
--   LUA_PATH='FOLDER/?.lua;;' lua5.2 hello.lua
-- The world is that of CRADLE_LCM_URL and CRADLE_WORLD.
--
-- What every language has to know: liblcm 1.3.1 does not survive hostile datagrams; a handler that
-- throws makes its next handle() abort; and its queue drops the newest messages, so handle them
-- often. Ids, sequences, ticks and epochs stay below 2^53: a double holds them.

local lcm = require 'lcm'
local versions = { body_spec = 3, spawn = 3, world_status = 3 } -- of the others: 1
local function wire(name) return require('cradle_wire.' .. name .. '_v' .. (versions[name] or 1)) end

-- liblcm-lua 1.3.1 unpacks at most 20 numbers at once; the heartbeat has 41 in a row: one by one.
local unpack_few, bytes_of = lcm._pack.unpack, { i = 4, q = 8, d = 8 }
function lcm._pack.unpack(format, bytes)
  if not format:match('^>[iqd]+$') then return unpack_few(format, bytes) end
  local values, at = {}, 1
  for letter in format:gmatch('[iqd]') do
    values[#values + 1] = unpack_few('>' .. letter, bytes:sub(at, at + bytes_of[letter] - 1))
    at = at + bytes_of[letter]
  end
  return table.unpack(values)
end

local kProtocolVersion = 2
local kOk = 0
local interim = { [1] = 'queued', [2] = 'held', [14] = 'gap', [18] = 'busy' } -- of protocol/include/cradle/result.h

local url = os.getenv('CRADLE_LCM_URL') or 'udpm://239.255.76.67:7667?ttl=0'
local world = os.getenv('CRADLE_WORLD') or 'default'
local function channel(kind) return 'CRADLE_' .. world .. '_' .. kind end

local function fail(code, text)
  io.stderr:write('hello.lua: ', text, '\n')
  os.exit(code)
end

-- Names are byte[32], zero padded.
local function set_name(message, text)
  for i = 1, #message.name do message.name[i] = text:byte(i) or 0 end
end

-- Calls `take` with every message of `kind` that decodes; what does not is counted.
local malformed = 0
local function listen(port, kind, type, take)
  port:subscribe(channel(kind), function(_, bytes)
    local is_whole, message = pcall(type.decode, bytes)
    if not is_whole or not pcall(take, message) then malformed = malformed + 1 end
  end)
end

-- Handles what comes within `wait_ms`; true if something came.
local function receive(port, wait_ms)
  local has_come = port:handle_timeout(wait_ms)
  while has_come and port:handle_timeout(0) do end
  return has_come
end

-- Handles messages until `is_done()`; gives up after some seconds.
local function receive_until(port, is_done, what)
  local begin = os.time()
  while not is_done() do
    if os.time() > begin + 5 then fail(69, 'no ' .. what) end
    receive(port, 100)
  end
end

-- 1. The control port carries commands, receipts, the heartbeat and events. The heartbeat tells the
-- epoch, which is this run of the server, and the port of states. While the epoch we know is heard,
-- another one is a stranger: a recording played back, or a second server.

local control = lcm.lcm.new(url)
local status
listen(control, 'STATUS', wire 'world_status', function(s)
  if not status or s.epoch == status.epoch then status = s end
end)
receive_until(control, function() return status end, 'heartbeat of world ' .. world .. ' on ' .. url)
if status.protocol_version ~= kProtocolVersion then fail(69, 'another protocol version') end
print(string.format('%s: tick %d, %g Hz, %d bodies', world, status.tick, status.rate_hz, status.bodies))

-- 2. A command carries our number, a sequence without gaps and the epoch. It is sent again, byte by
-- byte the same, until its receipt comes; the server does it once. `queued` is not the last word,
-- `gap` and `busy` ask to send it again.

local urandom = assert(io.open('/dev/urandom', 'rb'))
local b = { urandom:read(6):byte(1, 6) }
urandom:close()
local client = 1 -- random, 1 .. 2^48
for i = 1, 6 do client = client + b[i] * 256 ^ (i - 1) end

local sequence = 0
local answers = {} -- receipts by sequence
listen(control, 'RECEIPTS', wire 'receipts', function(message)
  if message.epoch ~= status.epoch then return end
  for _, receipt in ipairs(message.receipts) do
    if receipt.client == client and not interim[receipt.result] then answers[receipt.sequence] = receipt end
  end
end)

local function command(kind, message)
  sequence = sequence + 1
  local header = wire('command_header'):new()
  header.client, header.sequence = client, sequence
  header.epoch = status.epoch
  message.header = header
  local bytes = message:encode()
  local begin, sent = os.time(), nil
  while not answers[sequence] do
    local now = os.time() -- s: Lua has no finer clock
    if now > begin + 5 then fail(69, 'no receipt of ' .. kind) end
    if now ~= sent then control:publish(channel(kind), bytes) end
    sent = receive(control, 100) and now or nil -- again after 0.1 s of silence, or the next second
  end
  local receipt = answers[sequence]
  if receipt.result ~= kOk then fail(1, kind .. ' refused with code ' .. receipt.result) end
  print(string.format('%s receipt: sequence %d, body %d, tick %d', kind, sequence, receipt.body, receipt.tick))
  return receipt
end

-- 3. Hello opens the sequence. A client that lives on says it again, under its last number, if it
-- has been silent for some seconds: a full server forgets who is silent for ten.

local hello = wire('hello'):new()
hello.protocol_version = kProtocolVersion
set_name(hello, 'hello.lua')
command('HELLO', hello)

-- 4. Spawn a ball. A list is one datagram, and happens as a whole or not at all.

local spec_type = wire 'body_spec'
local ball = spec_type:new()
ball.kind, ball.shape = spec_type.DYNAMIC, spec_type.SPHERE
ball.shape_parameters[1] = 0.25 -- m
ball.mass_kg = 3
ball.p_WBo_m = { 0, 0, 5 }
ball.q_WB = { 1, 0, 0, 0 }
set_name(ball, 'Bällchen')
local spawn = wire('spawn'):new()
spawn.count, spawn.bodies = 1, { ball }
local body = command('SPAWN', spawn).body

-- 5. Push it: an impulse of 7 N s in the world's frame at the centre of mass, in one tick.

local wrench_type = wire 'wrench_spec'
local kick = wrench_type:new()
kick.body = body
kick.quantity, kick.frame = wrench_type.IMPULSE, wrench_type.WORLD
kick.point_kind, kick.duration_kind = wrench_type.CENTRE_OF_MASS, wrench_type.THIS_TICK
kick.value = { 7, 0, 0 }
local push = wire('wrench'):new()
push.count, push.wrenches = 1, { kick }
local pushed = command('WRENCH', push).tick -- the first tick whose state shows it

-- 6. See it move. States have a port of their own and come in chunks; each tells all there is about
-- the ids of its range, so that a body that is not listed there does not exist any more.

local seen, seen_tick, is_gone
local group, options = url:match('^(udpm://[%d.]+):?%d*(.*)$')
local states = lcm.lcm.new(group .. ':' .. status.state_port .. options)
listen(states, 'STATES', wire 'body_states', function(chunk)
  local is_ours = chunk.epoch == status.epoch and chunk.first_body <= body and body <= chunk.last_body
  if not is_ours or (seen_tick and chunk.tick < seen_tick) then return end
  is_gone, seen_tick = true, chunk.tick
  for _, state in ipairs(chunk.states) do
    if state.body == body then seen, is_gone = state, false end
  end
end)
for t = pushed, pushed + 50, 10 do
  receive_until(states, function() return seen and seen_tick >= t end, 'states')
  print(string.format('tick %d: x %.17g m, z %.17g m, vx %.17g m/s', seen_tick,
    seen.p_WBo_m[1], seen.p_WBo_m[3], seen.v_WBcm_mps[1]))
end

-- 7. Take it away again.

local despawn = wire('despawn'):new()
despawn.count, despawn.removed = 1, { body }
local removed = command('DESPAWN', despawn).tick
receive_until(states, function() return seen_tick >= removed and is_gone end, 'states')
print('gone, ' .. malformed .. ' malformed messages')
