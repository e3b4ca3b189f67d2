-- What somebody does in Neovim: `nvim --headless -u NONE MODEL.yaml -c 'luafile neovim.lua'`, with LSP and SAID in the
-- environment, the server's command and the file for what is found.

local said = {}
local client = { name = "epicycle", cmd = vim.json.decode(vim.env.LSP), root_dir = vim.fn.getcwd() }
vim.o.hidden = true
vim.bo.filetype = "yaml"
if vim.lsp.start then
  vim.lsp.start(client)
else -- before 0.8
  vim.lsp.buf_attach_client(0, vim.lsp.start_client(client))
end

local function wait(what, condition)
  if not vim.wait(60000, condition, 20) then error(what .. " did not come") end
end

local function diagnostics()
  return vim.tbl_map(function(each) return { each.lnum, each.col, each.code, each.message } end, vim.diagnostic.get(0))
end

local function ask(method, params)
  local found = vim.lsp.buf_request_sync(0, method, params, 60000)
  for _, answer in pairs(found or {}) do
    if answer.error then error(answer.error.message) end
    return answer.result
  end
end

local function go(words) -- to the end of the first place with these words
  vim.fn.cursor(1, 1)
  vim.fn.search("\\V" .. words, "ce")
end

local function encoding()
  local clients = (vim.lsp.get_clients or vim.lsp.get_active_clients)()
  return clients[1].offset_encoding
end

local ok, wrong = pcall(function()
  wait("a diagnostic", function() return #vim.diagnostic.get(0) > 0 end)
  said.before = diagnostics()

  -- Complete the type that is half-written.
  go("type: Cloc")
  vim.cmd("normal! $")
  local params = vim.lsp.util.make_position_params(0, encoding())
  params.position.character = params.position.character + 1
  for _, item in ipairs(ask("textDocument/completion", params)) do
    if item.label == "Clock" then
      said.completed = item.documentation
      vim.lsp.util.apply_text_edits({ item.textEdit }, 0, encoding())
    end
  end
  wait("a text without problems", function() return #vim.diagnostic.get(0) == 0 end)

  go("  left")
  said.hover = ask("textDocument/hover", vim.lsp.util.make_position_params(0, encoding())).contents.value
  vim.lsp.buf.rename("planet")
  wait("another name", function() return vim.fn.search("planet.state", "nw") > 0 end)
  vim.cmd("silent wall")
end)
if not ok then said.error = tostring(wrong) end
vim.fn.writefile({ vim.json.encode(said) }, vim.env.SAID)
vim.cmd("qall!")
