"""Draws rows of plots as SVG."""
import math

WIDTH, HEIGHT, LEFT, TOP = 330, 260, 50, 30


def logarithmic(values):
    """Returns an axis that spans whole powers of ten: its ticks, and the place of a value on it, from 0 to 1."""
    logarithms = [math.log10(value) for value in values]
    low, high = math.floor(min(logarithms)), math.ceil(max(logarithms))
    return [10 ** power for power in range(low, high + 1)], lambda value: (math.log10(value) - low) / max(high - low, 1)


def linear(*ticks):
    return ticks, lambda value: (value - ticks[0]) / (ticks[-1] - ticks[0])


class Panel:
    """One plot of a row. The axis of x is logarithmic."""

    def __init__(self, number, title, x_axis, y_axis):
        self.x0, self.x_place, self.y_place = LEFT + number * (WIDTH + 50), x_axis[1], y_axis[1]
        self.parts = [f'<text x="{self.x0 + WIDTH / 2}" y="18" text-anchor="middle">{title}</text>']
        for tick in x_axis[0]:
            power = f'10<tspan dy="-4" font-size="9">{math.log10(tick):.0f}</tspan>'
            self.parts.append(f'<path d="M{self.x_of(tick):.1f} {TOP}v{HEIGHT}" stroke="#eee"/>'
                              f'<text x="{self.x_of(tick):.1f}" y="{TOP + HEIGHT + 16}" text-anchor="middle">{power}</text>')
        for tick in y_axis[0]:
            self.parts.append(f'<path d="M{self.x0} {self.y_of(tick):.1f}h{WIDTH}" stroke="#eee"/>'
                              f'<text x="{self.x0 - 6}" y="{self.y_of(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>')

    def x_of(self, x):
        return self.x0 + WIDTH * self.x_place(x)

    def y_of(self, y):
        return TOP + HEIGHT * (1 - self.y_place(y))

    def line(self, points, style):
        places = " ".join(f"{self.x_of(x):.1f},{self.y_of(y):.1f}" for x, y in points)
        self.parts.append(f'<polyline points="{places}" fill="none" {style}/>')


def svg(panels, legend):
    """Returns the panels as SVG, with a legend of pairs of a label and a line style."""
    parts = [part for panel in panels for part in panel.parts]
    for i, (label, style) in enumerate(legend):
        x, y = LEFT + i * 170, TOP + HEIGHT + 36
        parts.append(f'<path d="M{x} {y}h24" {style}/><text x="{x + 30}" y="{y + 4}">{label}</text>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + len(panels) * (WIDTH + 50)} {TOP + HEIGHT + 50}" '
            'font-family="sans-serif" font-size="12" fill="#444"><rect width="100%" height="100%" fill="white"/>\n'
            + "\n".join(parts) + "\n</svg>\n")
