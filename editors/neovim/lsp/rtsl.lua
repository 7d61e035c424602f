-- The language server, for `vim.lsp.enable("rtsl")` of Neovim 0.11 and later.
return require("rtsl").server()
