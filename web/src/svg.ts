// A canvas that writes SVG: what the page's drawings use of a canvas, with the same names.

export type Pen = Pick<
  CanvasRenderingContext2D,
  | "strokeStyle" | "fillStyle" | "lineWidth" | "font" | "textAlign" | "textBaseline" | "globalAlpha" | "imageSmoothingEnabled"
  | "clearRect" | "beginPath" | "moveTo" | "lineTo" | "stroke" | "fill" | "fillRect" | "rect" | "roundRect" | "clip" | "fillText"
  | "save" | "restore" | "translate" | "rotate" | "setLineDash"
> & {
  arc(x: number, y: number, radius: number, from: number, to: number): void; // whole circles alone
  drawImage(image: HTMLCanvasElement, x: number, y: number, width: number, height: number): void;
};

type Affine = [number, number, number, number, number, number];
const round = (x: number): string => String(Math.round(100 * x) / 100);
const escaped = (text: string): string => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

export class SvgPen implements Pen {
  strokeStyle: string | CanvasGradient | CanvasPattern = "#000";
  fillStyle: string | CanvasGradient | CanvasPattern = "#000";
  lineWidth = 1;
  font = "12px sans-serif";
  textAlign: CanvasTextAlign = "left";
  textBaseline: CanvasTextBaseline = "alphabetic";
  globalAlpha = 1;
  imageSmoothingEnabled = true;
  private parts: string[] = [];
  private path = "";
  private dash: number[] = [];
  private at: Affine = [1, 0, 0, 1, 0, 0];
  private clips = 0; // made so far
  private open = 0; // groups that clip, now
  private kept: { at: Affine; open: number }[] = [];
  private squares = ""; // of one colour, which become one path
  private squaresFill = "";

  constructor(private readonly width: number, private readonly height: number, private readonly paper: string) {}

  /** The picture. */
  text(): string {
    this.flush();
    const { width: w, height: h } = this;
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${w}" height="${h}" viewBox="0 0 ${w} ${h}"><rect width="${w}" height="${h}" fill="${this.paper}"/>${this.parts.join("\n")}</svg>\n`;
  }

  clearRect(): void {}
  beginPath(): void {
    this.path = "";
  }
  moveTo(x: number, y: number): void {
    this.path += `M${this.point(x, y)}`;
  }
  lineTo(x: number, y: number): void {
    this.path += `${this.path ? "L" : "M"}${this.point(x, y)}`;
  }
  rect(x: number, y: number, w: number, h: number): void {
    this.path += this.box(x, y, w, h);
  }
  roundRect(x: number, y: number, w: number, h: number, radii?: unknown): void {
    const r = Number(radii), turn = (to: string): string => `A${r} ${r} 0 0 1 ${to}`;
    this.path += `M${this.point(x + r, y)}L${this.point(x + w - r, y)}${turn(this.point(x + w, y + r))}L${this.point(x + w, y + h - r)}${turn(this.point(x + w - r, y + h))}L${this.point(x + r, y + h)}${turn(this.point(x, y + h - r))}L${this.point(x, y + r)}${turn(this.point(x + r, y))}Z`;
  }
  arc(x: number, y: number, radius: number): void {
    const half = (to: string): string => `A${round(radius)} ${round(radius)} 0 0 1 ${to}`;
    this.path += `M${this.point(x - radius, y)}${half(this.point(x + radius, y))}${half(this.point(x - radius, y))}Z`;
  }
  stroke(): void {
    if (this.path) this.put(`<path d="${this.path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}"${this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : ""}${this.alpha}/>`);
  }
  fill(): void {
    if (this.path) this.put(`<path d="${this.path}" fill="${this.fillStyle}"${this.alpha}/>`);
  }
  fillRect(x: number, y: number, w: number, h: number): void {
    const fill = `${this.fillStyle}"${this.alpha}`;
    if (fill !== this.squaresFill) this.flush();
    this.squaresFill = fill;
    this.squares += this.box(x, y, w, h);
  }
  fillText(text: string, x: number, y: number): void {
    const anchor = { center: "middle", right: "end", end: "end", left: "start", start: "start" }[this.textAlign];
    const [, size, family] = /^([\d.]+)px (.*)$/.exec(this.font)!, [px, py] = this.place(x, y);
    const down = this.textBaseline === "middle" ? 0.35 * Number(size) : 0;
    this.put(`<text x="${round(px)}" y="${round(py + down)}" font-size="${size}" font-family="${escaped(family)}" text-anchor="${anchor}" fill="${this.fillStyle}"${this.alpha}>${escaped(text)}</text>`);
  }
  drawImage(image: HTMLCanvasElement, x: number, y: number, w: number, h: number): void {
    const [px, py] = this.place(x, y);
    this.put(`<image x="${round(px)}" y="${round(py)}" width="${round(w)}" height="${round(h)}" preserveAspectRatio="none"${this.imageSmoothingEnabled ? "" : ' style="image-rendering:pixelated"'} href="${image.toDataURL()}"/>`);
  }
  save(): void {
    this.kept.push({ at: [...this.at], open: this.open });
  }
  restore(): void {
    const back = this.kept.pop();
    if (!back) return;
    for (; this.open > back.open; --this.open) this.put("</g>");
    this.at = back.at;
  }
  clip(): void {
    this.put(`<clipPath id="c${++this.clips}"><path d="${this.path}"/></clipPath><g clip-path="url(#c${this.clips})">`);
    ++this.open;
  }
  translate(x: number, y: number): void {
    const [px, py] = this.place(x, y);
    this.at = [...this.at.slice(0, 4), px, py] as Affine;
  }
  rotate(angle: number): void {
    const [a, b, c, d, e, f] = this.at, s = Math.sin(angle), o = Math.cos(angle);
    this.at = [a * o + c * s, b * o + d * s, c * o - a * s, d * o - b * s, e, f];
  }
  setLineDash(dash: Iterable<number>): void {
    this.dash = [...dash];
  }

  private get alpha(): string {
    return this.globalAlpha === 1 ? "" : ` opacity="${round(this.globalAlpha)}"`;
  }
  private place(x: number, y: number): [number, number] {
    const [a, b, c, d, e, f] = this.at;
    return [a * x + c * y + e, b * x + d * y + f];
  }
  private point(x: number, y: number): string {
    return this.place(x, y).map(round).join(" ");
  }
  private box(x: number, y: number, w: number, h: number): string {
    return `M${this.point(x, y)}L${this.point(x + w, y)}L${this.point(x + w, y + h)}L${this.point(x, y + h)}Z`;
  }
  private put(part: string): void {
    this.flush();
    this.parts.push(part);
  }
  private flush(): void {
    if (this.squares) this.parts.push(`<path d="${this.squares}" fill="${this.squaresFill}/>`);
    this.squares = "";
  }
}
