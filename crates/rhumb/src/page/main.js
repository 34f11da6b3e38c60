// Unpacks the program and shows it. `window.rhumb` is for whoever drives the page by a script.

(async () => {
  try {
    const began = performance.now();
    const meta = JSON.parse($('program').textContent);
    const data = await unpack(meta, $('columns').textContent.trim());
    $('columns').textContent = '';
    if (data.n === 0) { $('notice').textContent = 'This program has no moves.'; return; }
    const unpacked = performance.now();
    const page = new Page(data);
    window.rhumb = { page, data, milliseconds: { unpack: unpacked - began, build: performance.now() - unpacked } };
  } catch (error) {
    $('notice').textContent = `This browser cannot show the page: ${error.message}`;
    throw error;
  }
})();
