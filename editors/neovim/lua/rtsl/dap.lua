-- RTSL for nvim-dap: `require("rtsl.dap").setup()`.

local M = {}

-- Asks for numbers separated by a comma, and gives them as a list.
local function ask_numbers(prompt, default)
  local answer = vim.fn.input(prompt, default)
  return vim.tbl_map(tonumber, vim.split(answer, ",", { trimempty = true }))
end

-- The program that speaks the debug adapter protocol.
function M.adapter()
  return { type = "executable", command = require("rtsl").program(), args = { "dap" } }
end

-- The configurations that `:DapContinue` offers in a buffer with RTSL text.
function M.configurations()
  return {
    {
      type = "rtsl",
      request = "launch",
      name = "One pixel of a scene",
      scene = function()
        return vim.fn.input("Scene: ", vim.fn.getcwd() .. "/", "file")
      end,
      pixel = function()
        return ask_numbers("Pixel: ", "0,0")
      end,
      sample = 0,
      stopOnEntry = false,
    },
  }
end

-- Adds adapter and configurations to nvim-dap.
function M.setup()
  local dap = require("dap")
  dap.adapters.rtsl = M.adapter()
  dap.configurations.rtsl = M.configurations()
end

return M
