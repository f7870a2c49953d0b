// Small charts of every frame's values, with a cursor at the current one. A press moves there.
const CHART_HEIGHT_PX = 64;
const LABEL_PX = 16;

class Charts {
  constructor(element, head, go) {
    this.charts = head.charts.filter(({ values }) => values.some((value) => value > 0)).map((chart) => {
      const canvas = document.createElement("canvas"), figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      canvas.setAttribute("aria-label", chart.name);
      figure.append(caption, canvas);
      element.append(figure);
      const seek = (event) => {
        if (event.type === "pointerdown" || event.buttons) go(Math.round(event.offsetX / Math.max(canvas.clientWidth, 1) * (chart.values.length - 1)));
      };
      canvas.addEventListener("pointerdown", seek);
      canvas.addEventListener("pointermove", seek);
      return { ...chart, canvas, caption, highest: chart.values.reduce((most, value) => Math.max(most, value), 1e-9) };
    });
    element.hidden = this.charts.length === 0;
  }

  draw(at, colours) {
    // Turning the map changes nothing here.
    const shown = [at, this.charts[0]?.canvas.clientWidth, window.devicePixelRatio, colours.line].join();
    if (shown === this.shown) return;
    this.shown = shown;
    for (const { name, unit, values, canvas, caption, highest } of this.charts) {
      const value = values[at];
      caption.textContent = `${name}: ${value === undefined ? "-" : value.toLocaleString("en")}${unit ? ` ${unit}` : ""}`;
      const ratio = Math.min(window.devicePixelRatio || 1, 2), width = Math.max(canvas.clientWidth, 1), height = CHART_HEIGHT_PX;
      Object.assign(canvas, { width: width * ratio, height: height * ratio });
      const context = canvas.getContext("2d");
      if (!context) {
        // A browser whose drawing process starts anew has none: the next draw tries again.
        this.shown = undefined;
        continue;
      }
      context.scale(ratio, ratio);
      const x = (frame) => frame / Math.max(values.length - 1, 1) * (width - 2) + 1;
      const y = (value) => height - 2 - value / highest * (height - LABEL_PX);
      const every = Math.max(1, Math.floor(values.length / (2 * width)));
      context.beginPath();
      for (let frame = 0; frame < values.length; frame += every) context.lineTo(x(frame), y(values[frame]));
      context.strokeStyle = colours.line;
      context.stroke();
      context.fillStyle = colours.cursor;
      context.fillRect(x(at) - 0.75, 0, 1.5, height);
    }
  }
}
