-- What Neovim shows of a shader with `rtsl lsp`. Works from Neovim 0.7 on, which Debian 12 has.
--
-- The program is in RTSL_PROGRAM, the plugin in RTSL_PLUGIN; the folder has `wave.rtsl`, `halves.rtsl` and `ball.pbrt`.
-- The output is on standard output.

local program = os.getenv("RTSL_PROGRAM")
local folder = vim.fn.getcwd()

local function say(text)
  io.stdout:write(text .. "\n")
end

local function wait_for(what, condition)
  if not vim.wait(30000, condition, 20) then
    say("no " .. what)
    vim.cmd("cquit")
  end
end

vim.cmd("edit wave.rtsl")
local buffer = vim.api.nvim_get_current_buf()
local client_id = vim.lsp.start_client({ name = "rtsl", cmd = { program, "lsp" }, root_dir = folder })
vim.lsp.buf_attach_client(buffer, client_id)

wait_for("diagnostics", function()
  return #vim.diagnostic.get(buffer) > 0
end)
for _, found in ipairs(vim.diagnostic.get(buffer)) do
  say(("line %d: %s: %s"):format(found.lnum + 1, found.code, found.message:match("[^\n]*")))
end

-- Completes `rt_Hi` in `intersect`.
local function line_with(text)
  for number, line in ipairs(vim.api.nvim_buf_get_lines(buffer, 0, -1, true)) do
    if line:find(text, 1, true) then
      return number
    end
  end
  error("no line contains " .. text)
end

local function ask(method, parameters)
  local answers = vim.lsp.buf_request_sync(buffer, method, parameters, 30000)
  for _, answer in pairs(answers or {}) do
    if answer.error then
      say(method .. ": " .. answer.error.message)
    end
    return answer.result
  end
end

local line = line_with("rt_Hi")
vim.api.nvim_win_set_cursor(0, { line, vim.api.nvim_get_current_line():len() })
local text = vim.api.nvim_buf_get_lines(buffer, line - 1, line, true)[1]
vim.api.nvim_win_set_cursor(0, { line, #text })
local asked = vim.lsp.util.make_position_params(0, "utf-16")
asked.position.character = #text
local labels = {}
for _, item in ipairs(ask("textDocument/completion", asked) or {}) do
  if vim.startswith(item.label, "rt_Hi") then
    table.insert(labels, item.label)
  end
end
table.sort(labels)
say("completes " .. table.concat(labels, " "))

-- Renames a member by Neovim's own command.
local member = line_with("public float radius")
local column = vim.api.nvim_buf_get_lines(buffer, member - 1, member, true)[1]:find("radius") - 1
vim.api.nvim_win_set_cursor(0, { member, column })
vim.lsp.buf.rename("size")
wait_for("renaming", function()
  return vim.api.nvim_buf_get_lines(buffer, member - 1, member, true)[1]:find("size") ~= nil
end)
for _, renamed in ipairs(vim.api.nvim_buf_get_lines(buffer, 0, -1, true)) do
  if renamed:find("size", 1, true) then
    say("renamed: " .. vim.trim(renamed))
  end
end

-- Costs of lines and values of a pixel, by the plugin's commands.
vim.opt.runtimepath:prepend(os.getenv("RTSL_PLUGIN"))
local looks = require("rtsl.looks")
looks.define_commands()
local notified = {}
vim.notify = function(text)
  table.insert(notified, text)
end
local function run(command)
  notified = {}
  vim.cmd(command)
  wait_for("answer to " .. command, function()
    return #notified > 0
  end)
  return notified[1]
end

say("refused: " .. tostring(run("RtslCosts ball.pbrt"):find("save `.*wave.rtsl` first") ~= nil))
vim.cmd("silent write")
vim.cmd("edit halves.rtsl")
buffer = vim.api.nvim_get_current_buf()
vim.lsp.buf_attach_client(buffer, client_id)

-- The texts at the ends of lines that contain a pattern.
local function notes(pattern)
  local found = {}
  local namespace = vim.api.nvim_get_namespaces()["rtsl.looks"]
  for _, mark in ipairs(vim.api.nvim_buf_get_extmarks(buffer, namespace, 0, -1, { details = true })) do
    local text = mark[4].virt_text[1][1]
    if text:find(pattern) then
      table.insert(found, ("%d %s"):format(mark[2] + 1, text))
    end
  end
  return found
end

say(run("RtslCosts ball.pbrt"))
local costs = notes(" %%")
say("costs: " .. tostring(#costs > 0))
say(run("RtslPixel ball.pbrt 2 4"):match("^[^\n]*"))
say((table.concat(notes(" = "), "; "):gsub("%d+%.%d+", "N")))
-- A line that changes loses its notes, and others move.
vim.api.nvim_buf_set_lines(buffer, 3, 4, true, { "", "    float x = rt_TextureUV.x - 0.25;" })
say((table.concat(notes(" = "), "; "):gsub("%d+%.%d+", "N")))
say("costs move: " .. tostring(#notes(" %%") > 0 and #notes(" %%") < #costs))
vim.cmd("RtslClear")
say("cleared: " .. tostring(#notes("") == 0))

vim.lsp.stop_client(client_id)
vim.cmd("qall!")
