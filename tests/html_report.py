#!/usr/bin/env python3
"""The page of glint accuracy, as a browser shows it: its plots, its slider, its tables, its pictures.

usage: html_report.py CHROMIUM PAGE.html [REPORT.json]

REPORT.json is what the same run printed; the page is to carry it.
"""
import json
import math
import re
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

browser_path, page_path = sys.argv[1:3]
address = Path(page_path).resolve().as_uri()
source = Path(page_path).read_text(encoding="utf-8")

# The figure of each kind that docs/accuracy.md says is plotted.
FIGURES = {
    "object": lambda errors: errors["object"]["edge"] + errors["object"]["away"],
    "shadow": lambda errors: errors["shadow"]["edge"] + errors["shadow"]["away"],
    "path": lambda errors: errors["path"]["edge"] + errors["path"]["away"],
    "shading": lambda errors: errors["shading"]["rmse"],
    "t": lambda errors: errors["t"]["relative"]["p99_9"],
    "normal": lambda errors: errors["normal"]["p99_9"],
    "image": lambda errors: errors["image"]["rmse"],
    "flip": lambda errors: errors["image"]["flip_mean"],
}

checked = 0


def expect(what, found, expected, tolerance=0.0):
    """Numbers may differ by `tolerance`, relative; else both are the same."""
    global checked
    checked += 1
    same = math.isclose(found, expected, rel_tol=tolerance) if tolerance else found == expected
    if not same:
        sys.exit(f"{what}: {found!r}, expected {expected!r}")


figures_text = re.search(r'<script type="application/json" id="figures">\n(.*?)\n\n?</script>', source, re.S).group(1)
report = json.loads(figures_text)
if len(sys.argv) > 3:
    printed = Path(sys.argv[3]).read_text(encoding="utf-8")
    expect("the page's figures are what --json prints", figures_text.replace("\\u003c", "<").strip(), printed.strip())

# What the browser drew: of each panel the ticks and points, as they lie on the screen.
PANELS = """section => [...section.querySelectorAll('.panels svg')].map(svg => ({
    kind: svg.dataset.kind,
    ticks: [...svg.querySelectorAll('.tick')].map(tick => ({
        axis: tick.classList.contains('x') ? 'x' : 'y', value: Number(tick.dataset.value),
        x: tick.getCTM().e, y: tick.getCTM().f, label: tick.querySelector('text')?.textContent ?? null,
    })),
    points: [...svg.querySelectorAll('.point')].map(point => ({
        variant: Number(point.dataset.variant), x: point.getCTM().e, y: point.getCTM().f,
        hollow: getComputedStyle(point.querySelector('use')).fill !== getComputedStyle(point.querySelector('use')).stroke,
        crossed: point.querySelector('.cross') !== null,
        size: point.querySelector('use').getBoundingClientRect().width,
        bar: (bar => [bar.left, bar.right])(point.querySelector('.spread').getBoundingClientRect()),
        left: svg.getBoundingClientRect().left,
    })),
}))"""


def number_of_label(label):
    """10⁻⁷ is 1e-7, 50 is 50."""
    digits = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
    power = re.fullmatch("10([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)", label)
    return 10.0 ** int(power.group(1).translate(digits)) if power else float(label)


def inverse_axis(ticks, axis):
    """From a place on the screen to a value, by the axis' first and last tick; 0 has a tick of its own."""
    ticks = sorted((tick for tick in ticks if tick["axis"] == axis), key=lambda tick: tick["value"])
    zero = [tick[axis] for tick in ticks if tick["value"] == 0]
    ticks = [tick for tick in ticks if tick["value"] > 0]
    if not ticks:
        return lambda place: 0.0 if math.isclose(place, zero[0]) else math.nan
    (a, b) = ticks[0], ticks[-1]
    slope = math.log(b["value"] / a["value"]) / (b[axis] - a[axis])
    for tick in ticks:  # the ticks between agree, and labels say what they mark
        expect("tick", a["value"] * math.exp(slope * (tick[axis] - a[axis])), tick["value"], 1e-3)
        if tick["label"]:
            expect("label of a tick", number_of_label(tick["label"]), tick["value"], 1e-9)

    def value(place):
        if zero and abs(place - zero[0]) < 0.01:
            return 0.0
        return a["value"] * math.exp(slope * (place - a[axis]))

    return value


def check_panel(panel, scene):
    kind = panel["kind"]
    expected = {
        i: FIGURES[kind](variant["errors"])
        for i, variant in enumerate(scene["variants"])
        if variant["status"] == "measured" and kind in variant["pareto"]
    }
    expect(f"variants plotted, {kind}", sorted(point["variant"] for point in panel["points"]), sorted(expected))
    time_at, error_at = inverse_axis(panel["ticks"], "x"), inverse_axis(panel["ticks"], "y")
    for point in panel["points"]:
        variant = scene["variants"][point["variant"]]
        where = f"{kind} of variant {point['variant']}"
        error = expected[point["variant"]]
        expect(f"time, {where}", time_at(point["x"]), variant["frame_ms"]["median"], 1e-3)
        expect(f"error, {where}", error_at(point["y"]), error, 1e-3 if error else 0.0)
        for end, place in zip(("min", "max"), point["bar"]):
            expect(f"{end}, {where}", time_at(place - point["left"]), variant["frame_ms"][end], 0.03)
        expect(f"hollow, {where}", point["hollow"], not variant["pareto"][kind])
        expect(f"crossed out, {where}", point["crossed"], variant["crossed_out"])
        expect(f"mark is seen, {where}", point["size"] > 4, True)


def check_plot(section, scene):
    panels = section.evaluate(PANELS)
    kinds = {kind for variant in scene["variants"] for kind in variant.get("pareto", {})}
    expect("kinds plotted", {panel["kind"] for panel in panels}, kinds)
    for panel in panels:
        check_panel(panel, scene)
    choice = section.locator(".plot select")
    choice.select_option("image")
    panels = section.evaluate(PANELS)
    expect("one kind chosen", [panel["kind"] for panel in panels], ["image"])
    check_panel(panels[0], scene)
    choice.select_option("")


def check_slider(page, section):
    slider, upper = section.locator(".stage input"), section.locator(".stage img.left")
    slider.scroll_into_view_if_needed()

    def split():
        """What is cut off the upper picture, from the right, as the browser computes it: a share."""
        clip = upper.evaluate("image => getComputedStyle(image).clipPath")
        cut = re.fullmatch(r"inset\(0px (?:calc\()?([\d.]+)% ?[^)]*\)?.*\)", clip) or sys.exit(f"clip-path: {clip}")
        return 100 - float(cut.group(1))

    expect("the slider starts in the middle", split(), 50.0)
    box = slider.bounding_box()
    y = box["y"] + min(box["height"], page.viewport_size["height"]) / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 4, y, steps=5)
    page.mouse.up()
    expect("dragged to a quarter", abs(split() - 25) < 0.5, True)
    before = split()
    slider.focus()
    page.keyboard.press("ArrowRight")
    expect("an arrow key moves it", before < split() < before + 5, True)
    page.keyboard.press("End")
    expect("the key End", split(), 100.0)
    page.keyboard.press("Home")
    expect("the key Home", split(), 0.0)

    pictures = section.locator("img[data-name]")
    for side in ("left", "right"):
        last = pictures.count() - 1
        section.locator(f"select.{side}").select_option(str(last))
        expect(f"the picture chosen on the {side}", section.locator(f".stage img.{side}").get_attribute("src"),
               pictures.nth(last).get_attribute("src"))

    button = section.locator(".worst button").first
    button.click()
    figure = section.locator(".worst figure").first
    x, y = int(figure.get_attribute("data-x")), int(figure.get_attribute("data-y"))
    stage = section.locator(".stage").bounding_box()
    pane = section.locator(".window").bounding_box()
    width = int(pictures.first.get_attribute("width"))
    expect("a worst pixel is shown eight times as large", stage["width"], 8.0 * width)
    for at, start, size in ((x, "x", "width"), (y, "y", "height")):
        place = stage[start] + 8 * (at + 0.5)
        expect("a worst pixel is in sight", pane[start] <= place <= pane[start] + pane[size], True)


def table_count(scene):
    """A file has colors only: nothing is known of objects, and of what follows from them."""
    return 3 if scene["reference"]["kind"] == "file" else 4


def check_tables(page, section, scene):
    """Each table's numbers sort, both ways, by pointer and by key; the times are the figures'."""
    tables = section.locator("table.sortable")
    expect("tables", tables.count(), table_count(scene))
    for i in range(tables.count()):
        table = tables.nth(i)
        headings = table.locator("thead th")
        for column in range(1, headings.count()):
            heading = headings.nth(column)
            values = f"""table => [...table.tBodies[0].rows].map(row => row.cells[{column}].querySelector('data')?.value ?? null)"""
            if any(value is None for value in table.evaluate(values)):
                continue
            heading.locator("button").click()
            numbers = [float(value) for value in table.evaluate(values)]
            expect("sorted by the pointer", numbers, sorted(numbers))
            expect("aria-sort", heading.get_attribute("aria-sort"), "ascending")
            heading.locator("button").focus()
            page.keyboard.press("Enter")
            numbers = [float(value) for value in table.evaluate(values)]
            expect("sorted by a key", numbers, sorted(numbers, reverse=True))
            expect("aria-sort", heading.get_attribute("aria-sort"), "descending")
            expect("one column is sorted by", table.locator("th[aria-sort]").count(), 1)
    for index, variant in enumerate(scene["variants"]):
        cell = tables.first.locator(f'tr[data-variant="{index}"] td').first.locator("data")
        expect("time in the table", float(cell.get_attribute("value")), variant["frame_ms"]["median"], 1e-9)


def srgb_8_bits(value):
    """IEC 61966-2-1:1999."""
    value = min(max(value, 0.0), 1.0)
    curved = 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055
    return math.floor(255 * curved + 0.5)


def check_pictures(section, scene):
    """The worst pixels of each picture have the colors that the figures say."""
    pixel = """(section, [picture, x, y]) => {
        const image = section.querySelector(`img[data-picture="${picture}"]`);
        const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight), context = canvas.getContext('2d');
        context.drawImage(image, 0, 0);
        return [canvas.width, canvas.height, ...context.getImageData(x, y, 1, 1).data.slice(0, 3)];
    }"""
    for index, variant in enumerate(scene["variants"]):
        if not section.locator(f'img[data-picture="{index}"]').count():
            continue  # another variant's picture is the same
        for kind, worst in variant["worst"].items():
            if not worst:
                continue
            for picture, color in (("reference", worst["reference_color"]), (str(index), worst["variant_color"])):
                found = section.evaluate(pixel, [picture, worst["x"], worst["y"]])
                expected = [*scene["size"], *map(srgb_8_bits, color)]
                close = all(abs(a - b) <= 1 for a, b in zip(found, expected))
                expect(f"worst pixel, {kind}: {found} for {expected}", close, True)
    broken = section.evaluate("section => [...section.querySelectorAll('img')].filter(i => !i.naturalWidth).length")
    expect("pictures that cannot be shown", broken, 0)


def overflow(page):
    return page.evaluate("document.documentElement.scrollWidth - window.innerWidth")


def check_page(page):
    page.goto(address)
    sections = page.locator("section.scene")
    expect("scenes", sections.count(), len(report["scenes"]))
    for i, scene in enumerate(report["scenes"]):
        section = sections.nth(i)
        expect("the scene's name", section.locator("h2").text_content(), scene["scene"])
        check_plot(section, scene)
        check_pictures(section, scene)
        check_tables(page, section, scene)
        check_slider(page, section)
    expect("elements that the scenes' names made", page.locator("h2 *, title *").count(), 0)
    expect("wider than a screen of 1280", max(overflow(page), 0), 0)
    page.set_viewport_size({"width": 390, "height": 844})
    expect("wider than a screen of 390", max(overflow(page), 0), 0)

    page.set_viewport_size({"width": 1280, "height": 900})
    page.emulate_media(media="print", color_scheme="dark")
    paper, ink = page.evaluate("(s => [s.backgroundColor, s.color])(getComputedStyle(document.documentElement))")
    expect("paper in print", paper, "rgb(255, 255, 255)")
    expect("ink in print", ink, "rgb(26, 26, 26)")
    expect("controls in print", page.locator(".no-print:visible").count(), 0)
    expect("printed", page.pdf(format="A4")[:5], b"%PDF-")


def check_without_script(page):
    page.goto(address)
    for i, scene in enumerate(report["scenes"]):
        section = page.locator("section.scene").nth(i)
        expect("tables without a script", section.locator("table.sortable:visible").count(), table_count(scene))
        expect("pictures without a script", section.locator("img[data-name]:visible").count() >= 3, True)
        expect("the plot's absence is told", section.locator("noscript").count(), 1)


def main():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        noise, requests = [], []
        for check, script in ((check_page, True), (check_without_script, False)):
            page = browser.new_context(java_script_enabled=script, viewport={"width": 1280, "height": 900}).new_page()
            page.on("console", lambda message: noise.append(message.text))
            page.on("pageerror", lambda error: noise.append(str(error)))
            page.on("request", lambda request: requests.append(request.url))
            check(page)
        browser.close()
    expect("the console", noise, [])
    beyond = [url[:80] for url in requests if url != address and not url.startswith("data:")]
    expect("requests beyond the page", beyond, [])
    print(checked, "checks")


main()
