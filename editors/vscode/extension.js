// Starts `specc lsp` once a YAML file turns up that is a specification, and speaks with it.
"use strict";

const vscode = require("vscode");
const { LanguageClient, TransportKind } = require("vscode-languageclient/node");

const SELECTOR = { language: "yaml", scheme: "file" };
const WATCHED = "**/*.{yaml,yml}";

let client;

function isSpecification(document) {
  if (document.languageId !== "yaml" || document.uri.scheme !== "file") {
    return false;
  }
  return /\.specc\.ya?ml$/.test(document.uri.path) || /^specc\s*:/m.test(document.getText());
}

function command() {
  const configured = vscode.workspace.getConfiguration("specc").get("command") || "specc";
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri.fsPath ?? "";
  return configured.replace("${workspaceFolder}", folder);
}

async function start() {
  if (client) {
    return;
  }
  const server = { command: command(), args: ["lsp"], transport: TransportKind.stdio };
  const options = {
    documentSelector: [SELECTOR],
    synchronize: { fileEvents: vscode.workspace.createFileSystemWatcher(WATCHED) },
  };
  client = new LanguageClient("specc", "specc", server, options);
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    const reason = error?.message ?? error;
    const words = `specc: \`${server.command} lsp\` does not start (${reason}). `;
    vscode.window.showErrorMessage(`${words}Install specc[editor] or set specc.command.`);
  }
}

async function stop() {
  const running = client;
  client = undefined;
  await running?.stop();
}

function activate(context) {
  const restart = async () => {
    await stop();
    await start();
  };
  const startFor = (document) => isSpecification(document) && start();
  context.subscriptions.push(
    vscode.commands.registerCommand("specc.restart", restart),
    vscode.workspace.onDidOpenTextDocument(startFor),
    vscode.workspace.onDidSaveTextDocument(startFor),
    vscode.workspace.onDidChangeConfiguration(
      (event) => client && event.affectsConfiguration("specc.command") && restart(),
    ),
  );
  vscode.workspace.textDocuments.forEach(startFor);
}

module.exports = { activate, deactivate: stop };
