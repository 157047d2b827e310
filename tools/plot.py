"""Draws plots with two logarithmic axes as SVG."""
import math

WIDTH, HEIGHT, LEFT, TOP = 330, 260, 50, 30


class LogPanel:
    """One plot of a row of plots, whose axes span whole powers of ten."""

    def __init__(self, number, title, x_values, y_values):
        self.x0 = LEFT + number * (WIDTH + 50)
        self.low_x, self.high_x = powers_around(x_values)
        self.low_y, self.high_y = powers_around(y_values)
        self.parts = [f'<text x="{self.x0 + WIDTH / 2}" y="18" text-anchor="middle">{title}</text>']
        for power in range(self.low_x, self.high_x + 1):
            x = self.x_of(10 ** power)
            self.parts.append(f'<path d="M{x:.1f} {TOP}v{HEIGHT}" stroke="#eee"/>'
                              f'<text x="{x:.1f}" y="{TOP + HEIGHT + 16}" text-anchor="middle">10<tspan dy="-4" font-size="9">{power}</tspan></text>')
        for power in range(self.low_y, self.high_y + 1):
            y = self.y_of(10 ** power)
            self.parts.append(f'<path d="M{self.x0} {y:.1f}h{WIDTH}" stroke="#eee"/>'
                              f'<text x="{self.x0 - 6}" y="{y + 4:.1f}" text-anchor="end">{10 ** power:g}</text>')

    def x_of(self, x):
        return self.x0 + WIDTH * (math.log10(x) - self.low_x) / max(self.high_x - self.low_x, 1)

    def y_of(self, y):
        return TOP + HEIGHT * (self.high_y - math.log10(y)) / max(self.high_y - self.low_y, 1)

    def line(self, points, style):
        places = " ".join(f"{self.x_of(x):.1f},{self.y_of(y):.1f}" for x, y in points)
        self.parts.append(f'<polyline points="{places}" fill="none" {style}/>')


def powers_around(values):
    logarithms = [math.log10(value) for value in values]
    return math.floor(min(logarithms)), math.ceil(max(logarithms))


def svg(panels, legend):
    """Returns the panels as SVG, with a legend of pairs of a label and a line style."""
    parts = [part for panel in panels for part in panel.parts]
    for i, (label, style) in enumerate(legend):
        x, y = LEFT + i * 170, TOP + HEIGHT + 36
        parts.append(f'<path d="M{x} {y}h24" {style}/><text x="{x + 30}" y="{y + 4}">{label}</text>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + len(panels) * (WIDTH + 50)} {TOP + HEIGHT + 50}" '
            'font-family="sans-serif" font-size="12" fill="#444"><rect width="100%" height="100%" fill="white"/>\n'
            + "\n".join(parts) + "\n</svg>\n")
