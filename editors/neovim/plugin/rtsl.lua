-- Starts the language server in buffers with RTSL text, and defines what its code lenses run.

if vim.g.loaded_rtsl then
  return
end
vim.g.loaded_rtsl = true

if vim.fn.has("nvim-0.10") == 0 then
  vim.notify("RTSL needs Neovim 0.10 or later", vim.log.levels.WARN)
  return
end

local rtsl = require("rtsl")

vim.lsp.commands["rtsl.test"] = rtsl.run_lens
vim.lsp.commands["rtsl.bench"] = rtsl.run_lens
vim.lsp.commands["rtsl.lineCosts"] = function(command)
  require("rtsl.looks").run_lens(command)
end

require("rtsl.looks").define_commands()
vim.api.nvim_create_autocmd("FileType", {
  pattern = "rtsl",
  callback = function(event)
    require("rtsl.looks").draw(event.buf)
  end,
})

if vim.lsp.enable then
  vim.lsp.enable("rtsl")
else
  vim.api.nvim_create_autocmd("FileType", {
    pattern = "rtsl",
    callback = function(event)
      rtsl.start_server(event.buf)
    end,
  })
end
