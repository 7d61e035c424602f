// The page of a preview: a picture, a line of status below it, and an error over it.

/** A message to the page. */
export type Message =
    | { type: "picture"; source: string; status: string }
    | { type: "status"; status: string }
    | { type: "error"; text: string };

/** The page. Its script runs only with this nonce. */
export function page(nonce: string): string {
    return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; img-src data:; style-src 'nonce-${nonce}'; script-src 'nonce-${nonce}'">
<style nonce="${nonce}">
body { padding: 0; margin: 0; height: 100vh; display: flex; flex-direction: column; }
main { flex: 1; min-height: 0; display: flex; align-items: center; justify-content: center; }
img { max-width: 100%; max-height: 100%; width: 100%; height: 100%; object-fit: contain; }
main.failed img { opacity: 0.25; }
pre { position: absolute; inset: 0 0 1.6em; margin: 0; padding: 1em; overflow: auto;
  font-family: var(--vscode-editor-font-family); font-size: var(--vscode-editor-font-size);
  color: var(--vscode-errorForeground); }
footer { height: 1.6em; line-height: 1.6em; padding: 0 1em; color: var(--vscode-descriptionForeground); }
[hidden] { display: none; }
</style>
</head>
<body>
<main><img alt="" hidden></main>
<pre role="alert" hidden></pre>
<footer role="status"></footer>
<script nonce="${nonce}">
const [main, img, pre, footer] = ["main", "img", "pre", "footer"].map((name) => document.querySelector(name));
addEventListener("message", ({ data }) => {
  const failed = data.type === "error";
  if (data.type === "picture") {
    img.src = data.source;
    img.hidden = false;
  }
  if (data.type !== "status") {
    main.classList.toggle("failed", failed);
    pre.hidden = !failed;
    pre.textContent = failed ? data.text : "";
  }
  footer.textContent = data.status ?? "";
});
</script>
</body>
</html>`;
}
