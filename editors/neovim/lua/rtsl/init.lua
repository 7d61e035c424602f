-- RTSL in Neovim: the language server, the commands of its code lenses, and the parser of tree-sitter.

local M = {}

-- The program: `vim.g.rtsl_path`, or the one on the PATH.
function M.program()
  return vim.g.rtsl_path or "rtsl"
end

-- The configuration of the language server.
function M.server()
  return {
    name = "rtsl",
    cmd = { M.program(), "lsp" },
    filetypes = { "rtsl" },
    root_markers = { "rtsl.toml", ".git" },
  }
end

-- Starts the language server for a buffer, in versions of Neovim before `vim.lsp.enable`.
function M.start_server(buffer)
  if vim.fn.executable(M.program()) == 0 then
    return
  end
  local server = M.server()
  local found = vim.fs.find(server.root_markers, { path = vim.api.nvim_buf_get_name(buffer), upward = true })[1]
  server.root_dir = found and vim.fs.dirname(found)
  vim.lsp.start(server, { bufnr = buffer })
end

-- True if Neovim finds the parser, `parser/rtsl.so` in a folder of its runtime path.
function M.has_parser()
  return #vim.api.nvim_get_runtime_file("parser/rtsl.*", false) > 0
end

-- The command line of a code lens: `rtsl test FILE --class CLASS`, or `rtsl bench FILE METHOD --class CLASS`.
function M.command_line(command)
  local uri, class, method = unpack(command.arguments)
  local words = { M.program(), command.command:match("^rtsl%.(%w+)$"), vim.uri_to_fname(uri) }
  if command.command == "rtsl.bench" and type(method) == "string" then
    table.insert(words, method)
  end
  if type(class) == "string" then
    vim.list_extend(words, { "--class", class })
  end
  return words
end

-- Runs a code lens in a terminal below.
function M.run_lens(command)
  local words = M.command_line(command)
  vim.cmd("botright 15new")
  if vim.fn.has("nvim-0.11") == 1 then
    vim.fn.jobstart(words, { term = true })
  else
    vim.fn.termopen(words)
  end
end

return M
