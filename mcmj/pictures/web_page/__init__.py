"""A trained body as one web page that runs MuJoCo itself, from the official WebAssembly package.

`package` fetches that package, `scene` is what a page shows, `page` puts both into the template.
The template is HTML, CSS and plain JavaScript beside them: `physics.js` (the loop), `drawing.js`,
`controls.js` (mouse, finger, keys, buttons) and `main.js` (frames, the check).
"""
