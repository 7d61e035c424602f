-- Costs of lines and values of a pixel, at the ends of lines. The language server runs the program for them, and has
-- them as inlay hints; buffers without inlay hints get the same texts here. Works from Neovim 0.7 on.

local M = {}

local namespace = vim.api.nvim_create_namespace("rtsl.looks")

-- The last answer to each command.
local answers = {}
-- The text of the line of each mark, by buffers and marks: lines that change lose their marks.
local texts = {}

-- The share of the cost of the hottest line from which on a line is hot.
local HOT = 0.3

local function report(text, level)
  vim.notify("RTSL: " .. text, level or vim.log.levels.INFO)
end

local function server()
  local clients = vim.lsp.get_clients and vim.lsp.get_clients() or vim.lsp.get_active_clients()
  for _, client in ipairs(clients) do
    if client.name == "rtsl" then
      return client
    end
  end
end

-- True if Neovim shows the hints of the server in a buffer.
local function has_hints(buffer)
  return vim.lsp.inlay_hint ~= nil and vim.lsp.inlay_hint.is_enabled({ bufnr = buffer })
end

local function line_at(buffer, line)
  return vim.api.nvim_buf_get_lines(buffer, line, line + 1, false)[1]
end

-- Deletes the marks from a line to another whose texts are not those that they were made for.
local function forget_changed(buffer, first, last)
  local known = texts[buffer] or {}
  for _, mark in ipairs(vim.api.nvim_buf_get_extmarks(buffer, namespace, { first, 0 }, { last, -1 }, {})) do
    local id, line = mark[1], mark[2]
    if known[id] ~= line_at(buffer, line) then
      vim.api.nvim_buf_del_extmark(buffer, namespace, id)
      known[id] = nil
    end
  end
end

-- Watches the changes of a buffer, once.
local function watch(buffer)
  if texts[buffer] then
    return
  end
  texts[buffer] = {}
  vim.api.nvim_buf_attach(buffer, false, {
    on_lines = function(_, _, _, first, _, last)
      forget_changed(buffer, first, last)
    end,
    on_reload = function()
      M.draw(buffer)
    end,
    on_detach = function()
      texts[buffer] = nil
    end,
  })
end

local function draw_file(buffer, file, hottest)
  for _, note in ipairs(file.lines) do
    local text = line_at(buffer, note.line)
    if text then
      local group = note.cost and note.cost >= HOT * hottest and "RtslHotLine" or "RtslLine"
      local options = { virt_text = { { note.label, group } }, virt_text_pos = "eol" }
      local id = vim.api.nvim_buf_set_extmark(buffer, namespace, note.line, 0, options)
      texts[buffer][id] = text
    end
  end
end

local function hottest_of(answer)
  local hottest = 0
  for _, file in ipairs(answer.files) do
    for _, note in ipairs(file.lines) do
      hottest = math.max(hottest, note.cost or 0)
    end
  end
  return hottest
end

-- Shows the last answers in a buffer.
function M.draw(buffer)
  vim.api.nvim_buf_clear_namespace(buffer, namespace, 0, -1)
  if has_hints(buffer) or not vim.api.nvim_buf_is_loaded(buffer) then
    return
  end
  local name = vim.api.nvim_buf_get_name(buffer)
  for _, answer in pairs(answers) do
    for _, file in ipairs(answer.files) do
      if vim.uri_to_fname(file.uri) == name then
        watch(buffer)
        draw_file(buffer, file, hottest_of(answer))
      end
    end
  end
end

local function draw_all()
  for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
    M.draw(buffer)
  end
end

-- The text about an answer.
local function summary(answer)
  local parts = { answer.title }
  if answer.color then
    table.insert(parts, ("(%s)"):format(table.concat(vim.tbl_map(tostring, answer.color), ", ")))
  end
  for _, printed in ipairs(answer.prints or {}) do
    table.insert(parts, "print: " .. printed.text)
  end
  for _, fault in ipairs(answer.notFinite or {}) do
    table.insert(parts, fault.message)
  end
  if answer.messages ~= "" then
    table.insert(parts, answer.messages)
  end
  return table.concat(parts, "\n")
end

-- Sends a command to the server; false if there is none.
local function send(command, argument, handler)
  local client = server()
  if not client then
    return false
  end
  local request = { command = command, arguments = { argument } }
  if vim.fn.has("nvim-0.11") == 1 then
    client:request("workspace/executeCommand", request, handler)
  else
    client.request("workspace/executeCommand", request, handler)
  end
  return true
end

-- Runs a command of the server, and shows the answer. `done`, if given, gets the error and the answer.
function M.run(command, argument, done)
  local function handler(error, answer)
    if error then
      report(error.message, vim.log.levels.ERROR)
    else
      answers[command] = answer
      draw_all()
      report(summary(answer))
    end
    if done then
      done(error, answer)
    end
  end
  if not send(command, argument, handler) then
    report("the language server does not run; open a shader first", vim.log.levels.ERROR)
  end
end

-- Shows the costs of all shaders of a scene, or of the classes of the buffer.
function M.costs(scene, done)
  local argument = { uri = vim.uri_from_bufnr(0) }
  if scene then
    argument = { scene = vim.fn.fnamemodify(scene, ":p") }
  end
  M.run("rtsl.lineCosts", argument, done)
end

-- Shows the values that the shaders of a scene compute for a pixel.
function M.pixel(scene, x, y, sample, done)
  M.run("rtsl.pixel", { scene = vim.fn.fnamemodify(scene, ":p"), x = x, y = y, sample = sample }, done)
end

-- Shows no costs and values any more.
function M.clear()
  answers = {}
  draw_all()
  send("rtsl.clearLooks", vim.empty_dict(), function() end)
end

-- Runs a code lens.
function M.run_lens(command)
  M.run(command.command, command.arguments[1])
end

-- Defines `:RtslCosts`, `:RtslPixel` and `:RtslClear`.
function M.define_commands()
  vim.api.nvim_set_hl(0, "RtslLine", { link = "Comment", default = true })
  vim.api.nvim_set_hl(0, "RtslHotLine", { link = "WarningMsg", default = true })
  vim.api.nvim_create_user_command("RtslCosts", function(command)
    M.costs(command.args ~= "" and command.args or nil)
  end, { nargs = "?", complete = "file", desc = "Costs of lines, in a scene if one is given" })
  vim.api.nvim_create_user_command("RtslPixel", function(command)
    local scene, x, y, sample = command.args:match("^(.-)%s+(%d+)[%s,]+(%d+)%s*(%d*)$")
    if not scene then
      report("`:RtslPixel scene.pbrt 320 240` needs a scene, a column and a row", vim.log.levels.ERROR)
      return
    end
    M.pixel(scene, tonumber(x), tonumber(y), tonumber(sample))
  end, { nargs = "+", complete = "file", desc = "Values that the shaders of a scene compute for a pixel" })
  vim.api.nvim_create_user_command("RtslClear", M.clear, { desc = "No costs and values any more" })
end

return M
