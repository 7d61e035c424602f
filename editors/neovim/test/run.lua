-- Tests of the plugin, in Neovim without a window:
--
--   nvim --clean --headless --cmd 'set runtimepath^=.' -c 'luafile test/run.lua'
--
-- in this folder, with the parser in `parser/rtsl.so`. A server inside Neovim takes the place of `rtsl lsp`.

local tests = {}

-- No server runs before the test of the server, even if there is an `rtsl` on the PATH.
vim.g.rtsl_path = "no-server"

local function equal(found, expected)
  if not vim.deep_equal(found, expected) then
    error(("found %s, expected %s"):format(vim.inspect(found), vim.inspect(expected)), 2)
  end
end

local sphere = vim.fn.fnamemodify("../../shaders/primitives/sphere.rtsl", ":p")

-- The captures at the first place where a line contains this text.
local function captures(text)
  for number, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, true)) do
    local column = line:find(text, 1, true)
    if column then
      local found = vim.treesitter.get_captures_at_pos(0, number - 1, column - 1)
      return vim.tbl_map(function(each)
        return each.capture
      end, found)
    end
  end
  error("no line contains " .. text)
end

function tests.files_have_the_type()
  vim.cmd.edit(sphere)
  equal(vim.bo.filetype, "rtsl")
  equal(vim.bo.commentstring, "// %s")
  equal(vim.bo.shiftwidth, 4)
end

function tests.the_parser_highlights()
  vim.cmd.edit(sphere)
  vim.treesitter.get_parser(0, "rtsl"):parse()
  equal(vim.treesitter.highlighter.active[vim.api.nvim_get_current_buf()] ~= nil, true)
  local function last(text)
    local found = captures(text)
    return found[#found]
  end
  equal(last("class"), "keyword.type")
  equal(last("rt_Primitive"), "type.builtin")
  equal(last("rt_RayOrigin"), "variable.builtin")
  equal(last("computeNormal"), "function.method")
end

function tests.queries_fit_the_parser()
  for _, name in ipairs({ "highlights", "injections", "locals", "folds", "indents" }) do
    equal(vim.treesitter.query.get("rtsl", name) ~= nil, true)
  end
end

function tests.classes_and_functions_are_folds()
  vim.cmd.edit(sphere)
  vim.treesitter.get_parser(0, "rtsl"):parse()
  vim.cmd("normal! zx")
  vim.wait(1000, function()
    return vim.fn.foldlevel(vim.fn.search("hit(", "w")) > 0
  end)
  equal(vim.fn.foldlevel(vim.fn.search("hit(", "w")) > 1, true)
end

function tests.bodies_are_indented()
  vim.cmd("enew! | setfiletype rtsl")
  vim.api.nvim_buf_set_lines(0, 0, -1, true, {
    "class A : rt_Texture;", "public float x = 1.0;", "void lookup() {", "switch (1) {", "case 0:",
    "rt_FloatTextureValue =", "x;", "}", "}",
  })
  vim.cmd("silent normal! gg=G")
  equal(vim.api.nvim_buf_get_lines(0, 0, -1, true), {
    "class A : rt_Texture;", "public float x = 1.0;", "void lookup() {", "    switch (1) {", "    case 0:",
    "        rt_FloatTextureValue =", "            x;", "    }", "}",
  })
end

-- A server that answers `initialize` and records the methods of what it receives.
local function recorder(received)
  return function()
    local closing = false
    return {
      request = function(method, _, callback)
        table.insert(received, method)
        callback(nil, method == "initialize" and { capabilities = { textDocumentSync = 1 } } or nil)
        return true, 1
      end,
      notify = function(method, params)
        table.insert(received, method)
        if method == "textDocument/didOpen" then
          received.language = params.textDocument.languageId
        end
        return true
      end,
      is_closing = function()
        return closing
      end,
      terminate = function()
        closing = true
      end,
    }
  end
end

function tests.the_server_starts()
  local received = {}
  if vim.lsp.config then
    vim.lsp.config("rtsl", { cmd = recorder(received) })
  else
    local rtsl = require("rtsl")
    local server = rtsl.server()
    rtsl.program = function()
      return "true"
    end
    server.cmd = recorder(received)
    rtsl.server = function()
      return server
    end
  end
  -- A file that no test has opened before.
  vim.cmd.edit((sphere:gsub("sphere", "torus")))
  vim.wait(3000, function()
    return received.language ~= nil
  end)
  equal(received.language, "rtsl")
  local client = vim.lsp[vim.lsp.get_clients and "get_clients" or "get_active_clients"]({ name = "rtsl" })[1]
  equal(client.config.root_dir, vim.fn.fnamemodify("../..", ":p"):gsub("/$", ""))
end

function tests.lenses_give_command_lines()
  local rtsl = require("rtsl")
  vim.g.rtsl_path = "/opt/rtsl"
  local uri = "file:///a%20b/c.rtsl"
  equal(
    rtsl.command_line({ command = "rtsl.test", arguments = { uri, "Sphere", vim.NIL } }),
    { "/opt/rtsl", "test", "/a b/c.rtsl", "--class", "Sphere" }
  )
  equal(
    rtsl.command_line({ command = "rtsl.bench", arguments = { uri, "Sphere", "intersect" } }),
    { "/opt/rtsl", "bench", "/a b/c.rtsl", "intersect", "--class", "Sphere" }
  )
  vim.g.rtsl_path = "echo"
  vim.lsp.commands["rtsl.test"]({ command = "rtsl.test", arguments = { uri } }, {})
  vim.wait(3000, function()
    return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, true)):find("test /a b/c.rtsl", 1, true) ~= nil
  end)
  equal(vim.api.nvim_buf_get_lines(0, 0, 1, true), { "test /a b/c.rtsl" })
end

function tests.the_debugger_is_set_up()
  vim.g.rtsl_path = nil
  package.loaded.dap = { adapters = {}, configurations = {} }
  require("rtsl.dap").setup()
  local dap = require("dap")
  equal(dap.adapters.rtsl, { type = "executable", command = "rtsl", args = { "dap" } })
  equal(dap.configurations.rtsl[1].request, "launch")
  vim.fn.input = function()
    return "320,240"
  end
  equal(dap.configurations.rtsl[1].pixel(), { 320, 240 })
end

-- The server comes last: buffers of later tests would start it, too.
local order = {
  "files_have_the_type", "the_parser_highlights", "queries_fit_the_parser", "classes_and_functions_are_folds",
  "bodies_are_indented", "lenses_give_command_lines", "the_debugger_is_set_up", "the_server_starts",
}
local failed = 0
for _, name in ipairs(order) do
  local ok, message = xpcall(tests[name], debug.traceback)
  failed = failed + (ok and 0 or 1)
  io.stdout:write(("%s %s%s\n"):format(ok and "ok    " or "FAILED", name, ok and "" or "\n" .. message))
end
vim.cmd(failed == 0 and "quitall!" or "cquit")
