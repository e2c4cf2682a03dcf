"use strict";
// hands.js: pointers, the wheel and keys move the camera and the listener of a view (view.js).

function press(view, event) {
  const {right} = view.camera.axes(), forth = unit([right[2], 0, -right[0]]), step = Math.max(0.1, view.camera.extent / 80);
  const moves = {ArrowLeft: times(right, -step), ArrowRight: times(right, step), ArrowUp: times(forth, step), ArrowDown: times(forth, -step), PageUp: [0, step, 0], PageDown: [0, -step, 0]};
  const turns = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]};
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.shiftKey && turns[event.key] !== undefined) view.camera.orbit(...turns[event.key]);
  else if (moves[event.key] !== undefined) view.moveTo(add(view.place, moves[event.key]));
  else if (event.key === "+" || event.key === "=") view.camera.zoom(0.85);
  else if (event.key === "-") view.camera.zoom(1 / 0.85);
  else if (event.key === "Home") view.camera.reset(), view.fitted = false;
  else if (event.key === "l" || event.key === "L") view.camera.lookAt(view.place.slice(), 1);
  else return;
  event.preventDefault();
  view.redraw();
}

function listenToHands(view) {
  const canvas = view.canvas, pointers = new Map();
  let drag = null, pinch = 0;
  const share = (event) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2, box];
  };
  const onListener = (event) => {
    const [x, y, box] = share(event), seen = view.camera.project(view.place, box.width / box.height);
    return seen !== null && Math.hypot((seen[0] - x) * box.width / 2, (seen[1] - y) * box.height / 2) < 20;
  };
  canvas.addEventListener("pointerdown", (event) => {
    view.steered = true;
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    drag = onListener(event) ? "listener" : event.shiftKey || event.button !== 0 ? "pan" : "orbit";
    canvas.style.cursor = "grabbing";
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) {
      canvas.style.cursor = onListener(event) ? "move" : "grab";
      return;
    }
    const [oldX, oldY] = pointers.get(event.pointerId), dx = event.clientX - oldX, dy = event.clientY - oldY;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 2) {
      const [[ax, ay], [bx, by]] = [...pointers.values()], apart = Math.hypot(ax - bx, ay - by);
      if (pinch > 0) view.camera.zoom(pinch / apart);
      pinch = apart;
      view.redraw();
    } else if (drag === "listener") {
      const [x, y, box] = share(event), place = view.camera.onPlane(x, y, box.width / box.height, view.place);
      if (place !== null) view.moveTo(place.map((value, i) => Math.min(Math.max(value, view.level.low[i] - 20), view.level.high[i] + 20)));
    } else if (drag === "pan") {
      view.camera.pan(dx / canvas.clientHeight * 0.7, dy / canvas.clientHeight * 0.7);
      view.redraw();
    } else {
      view.camera.orbit(-0.006 * dx, 0.006 * dy);
      view.redraw();
    }
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => { pointers.delete(event.pointerId); pinch = 0; drag = null; canvas.style.cursor = "grab"; });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); view.camera.zoom(Math.exp(0.0012 * event.deltaY)); view.redraw(); }, {passive: false});
  canvas.addEventListener("keydown", (event) => press(view, event));
}
