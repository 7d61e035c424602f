vim.filetype.add({ extension = { rtsl = "rtsl" } })
