-- What Neovim shows of a shader with `rtsl lsp`. Works from Neovim 0.7 on, which Debian 12 has.
--
-- The program is in RTSL_PROGRAM; the folder has `wave.rtsl` and `other.rtsl`. The output is on standard output.

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

vim.lsp.stop_client(client_id)
vim.cmd("qall!")
