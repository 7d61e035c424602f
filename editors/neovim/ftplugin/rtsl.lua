-- Settings of a buffer with RTSL text.

vim.bo.commentstring = "// %s"
vim.bo.comments = "s1:/*,mb:*,ex:*/,:///,://"
vim.bo.expandtab = true
vim.bo.shiftwidth = 4
vim.bo.softtabstop = 4
-- Members of a class without braces are not indented, nor are the labels of a `switch`.
vim.bo.cindent = true
vim.bo.cinoptions = ":0,l1,(4,W4,L0"

-- Highlighting and folds need the parser, `parser/rtsl.so`.
if vim.fn.has("nvim-0.10") == 1 and require("rtsl").has_parser() then
  vim.treesitter.start()
  vim.wo.foldexpr = "v:lua.vim.treesitter.foldexpr()"
  -- All folds are open at first.
  vim.wo.foldlevel = 99
  vim.wo.foldmethod = "expr"
end

vim.b.undo_ftplugin = "setlocal commentstring< comments< expandtab< shiftwidth< softtabstop< cindent< cinoptions<"
  .. " foldexpr< foldlevel< foldmethod<"
