"""The page in a real browser (headless Chromium), against the real daemon and the simulator as processes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from urllib.parse import quote
from urllib.request import Request, urlopen

import aiohttp
import pytest

from gatewayd.control.access import Role
from tests.e2e.plant import Plant
from tests.e2e.plc import HMI, PLC, Plc
from tests.e2e.processes import HOST, Daemon, Simulator, free_port
from tests.web.browser import CHROMIUM, Page, browsing
from tests.web.press import TOKEN, engineer, token, write_tokens

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="Chromium is not installed (Debian package chromium)"
)

MAPPING = """\
writers:
  plc: {modbus: 127.0.0.2}
  hmi: {modbus: 127.0.0.3}
variables:
  start:  {robot: input_bit_register_0, modbus: [0.0, {coil: 5}], owner: plc, comment: begin one cycle}
  part:   {robot: input_int_register_0, modbus: {holding: 10, type: uint16}, owner: plc, limits: [0, 999]}
  cycles: {robot: output_int_register_0, modbus: 110, on_stale: hold}
  tcp:    {robot: actual_TCP_pose, modbus: {holding: 130, type: float32}, unit: m}
"""
BOTH_BUSES = """\
canopen: {interface: virtual, channel: page, bitrate: 500000, node: 16}
writers:
  plc:  {modbus: 127.0.0.2}
  line: {canopen: rpdo}
variables:
  start:  {robot: input_bit_register_0, canopen: auto, owner: line, lease: 2s}
  part:   {robot: input_int_register_0, modbus: 10, canopen: object, owner: plc}
  force:  {robot: output_double_register_0, modbus: {holding: 104, type: float32}, canopen: auto, unit: N}
"""
CROWDED = """\
canopen: {interface: virtual, channel: page, bitrate: 500000, node: 16}
groups:
  motion: {owner: plc}
writers:
  plc: {modbus: 127.0.0.2}
  hmi_at_the_operator_panel_left: {modbus: 127.0.0.3}
variables:
  start: {robot: input_bit_register_0, modbus: [0.0, {coil: 5}], canopen: object, group: motion}
  speed_of_the_conveyor_belt_at_infeed:
    {robot: input_double_register_3, modbus: {holding: 20, type: float32}, group: motion, unit: mm/s}
  part: {robot: input_int_register_0, modbus: [10, {holding: 12}], owner: hmi_at_the_operator_panel_left}
  mode: {robot: robot_mode, modbus: 100}
  safety: {robot: safety_status, modbus: 102, canopen: auto}
  force: {robot: output_double_register_0, modbus: [{holding: 104, type: float32}, {input: 104, type: float32}],
          canopen: auto, unit: N}
  q: {robot: actual_q, modbus: {holding: 200, type: float32}, unit: rad}
"""
END = "new Date(new Date(document.getElementById('who').title.slice(16))).toLocaleTimeString()"
"""When the token ends, as the page says it to those who point at the name."""
LIVE = "document.body.dataset.contact === 'live'"
LOST = "document.body.dataset.contact === 'lost'"
NARROW, WIDE = (360, 740), (1280, 800)
WIDTHS = (360, 390, 820, 840, 1000, 1100, 1290, 1400)


@dataclass
class Shown:
    """A plant and the page that shows it."""

    page: Page
    simulator: Simulator
    daemon: Daemon
    plc: Plc
    url: str


@asynccontextmanager
async def showing(
    plant: Plant, size: tuple[int, int], *, dark: bool = False, mapping: str = MAPPING
) -> AsyncIterator[Shown]:
    simulator = plant.simulator()
    port = free_port()
    token = engineer(plant.directory / "tokens")
    file = plant.mapping(mapping, simulator.port)
    daemon = plant.daemon(file, "--status", f"{HOST}:{port}", "--token-file", token)
    plc = plant.ready_plc(PLC)
    daemon.wait_for_line("status page")
    async with browsing() as page:
        url = f"http://{HOST}:{port}/"
        await page.open(url, *size, dark=dark)
        await page.wait(LIVE)
        yield Shown(page, simulator, daemon, plc, url)


def force(shown: Shown, name: str, value: float) -> None:
    request = Request(  # noqa: S310 - loopback
        f"{shown.url}api/v1/variables/{quote(name)}/force",
        json.dumps({"value": value, "for": 60}).encode(),
        {"Authorization": f"Bearer {TOKEN}"},
    )
    with urlopen(request, timeout=10) as answer:  # noqa: S310 - loopback
        assert answer.status == 200


def text(selector: str) -> str:
    return f"document.querySelector({selector!r}).textContent"


def row(name: str, cell: str) -> str:
    rows = "[...document.querySelectorAll('#rows tr')]"
    return f"{rows}.find((row) => row.row?.variable.name === '{name}').querySelector('{cell}').textContent"


async def test_values_owners_and_events_are_live(plant: Plant) -> None:
    async with showing(plant, WIDE) as shown:
        page, plc = shown.page, shown.plc
        await page.wait(f"{text('.node.robot .state')}.includes('fresh and writable')")
        for number in (17, 18):
            assert plc.write(10, [number]) == 0
            await page.wait(f"{row('part', 'span.value')} === '{number}'")
            await page.wait(f"{row('cycles', 'span.value')} === '{number}'")
        await page.wait(f"{row('part', 'span.owner')} === 'plc'")
        await page.wait(f"{text('#owned')}.includes('part')")
        await page.wait(f"{text('#happened')}.includes('plc took part')")
        assert await page.run(row("part", "td.address")) == "10"
        assert await page.run(row("part", "td.notation")) == "400011"
        assert await page.run(row("start", "td.notation")) == "400001.0000006"
        assert await page.run(row("start", "td.address")) == "0.0coil 5"
        hmi = plant.plc(HMI)
        assert hmi.write(10, [5]) == 2
        refused = "document.querySelectorAll('.writers .node')[1]"
        await page.wait(f"{refused}.dataset.level === 'warn'")
        await page.wait(f"{refused}.dataset.level === 'good'")
        assert " ago: never writable" in await page.run(f"{refused}.textContent")
        await page.wait(f"{text('#happened')}.includes('hmi wrote part = 5: refused')")
        assert page.problems == []


async def test_a_lost_robot_does_not_look_fresh(plant: Plant) -> None:
    async with showing(plant, WIDE) as shown:
        page = shown.page
        fresh = await page.run("getComputedStyle(document.querySelector('#rows span.value')).color")
        shown.simulator.kill()
        await page.wait("document.querySelector('.node.robot').dataset.level === 'bad'")
        await page.wait(f"{text('.node.robot .state')}.includes('connection refused')")
        await page.wait(f"{row('cycles', 'span.quality')}.startsWith('stale')")
        stale = await page.run("getComputedStyle(document.querySelector('#rows span.value')).color")
        assert fresh != stale
        assert await page.run("document.title.startsWith('■')")
        assert await page.run(text("#worst")) == "■ Robot"
        assert "Not good 9" in await page.run(text("#kinds"))
        assert await page.run(CONTRASTS) == []
        await page.resize(*NARROW)
        await page.run("scrollTo(0, 1e6)")
        await page.run("document.getElementById('worst').click()")
        assert await page.run("scrollY") == 0


async def test_each_bus_has_its_columns(plant: Plant) -> None:
    """Modbus by both addresses, CANopen by object and COB-ID, under headings that say which is which."""
    async with showing(plant, WIDE, mapping=BOTH_BUSES) as shown:
        page = shown.page
        await page.wait(f"{text('#picture .bus:nth-of-type(4) strong')} === 'CAN page'")
        assert await page.run(row("part", "td.object")) == "2010h:01"
        assert await page.run(row("part", "td.cob-id")) == "by SDO"
        assert await page.run(row("start", "td.cob-id")) == "0x210"
        assert await page.run(row("start", "td.modbus")) == ""
        assert await page.run(row("force", "td.notation")) == "400105"
        await page.wait(
            f"{text('#picture .bus:nth-of-type(4) .state')}.includes('until a master starts the node')"
        )
        assert await page.run(text("#worst")) == "▲ CAN page"
        # What a CAN controller with a cut wire reports; no virtual bus gets there.
        await page.run(BUS_OFF)
        lines = "[...document.querySelectorAll('.buses .link')].map((link) => link.dataset.level).join()"
        await page.wait(f"{lines} === 'good,bad'")
        assert await page.run(text(".buses .link:nth-of-type(1) .label")) == "●Modbus"
        assert await page.run("[...document.querySelectorAll('.buses .label')][1].textContent") == "■CAN"
        assert await page.run(text("#worst")) == "■ CAN page"
        await page.open(shown.url, *WIDE)
        await page.wait(f"{lines} === 'good,warn'")
        for width in WIDTHS:
            await page.resize(width, 800)
            assert await page.run("document.documentElement.scrollWidth") <= width
            assert await page.run("document.querySelector('table').scrollWidth") <= await page.run(
                "document.getElementById('variables').clientWidth"
            ), width
        assert await page.run(HEADINGS) == 9
        await page.open(shown.url, *NARROW)
        await page.wait(f"{LIVE} && {row('part', 'td.object')} === '2010h:01'")
        labels = "getComputedStyle(document.querySelector('td.object'), '::before').content"
        assert await page.run(labels) == '"CANopen"'
        assert page.problems == []


async def test_the_table_stays_in_its_card_at_every_width(plant: Plant) -> None:
    """Names that do not break, several places, states in words, a force with its truth: all at once."""
    async with showing(plant, WIDE, mapping=CROWDED) as shown:
        page = shown.page
        await page.wait(f"{row('mode', '.meaning')} === 'running'")
        force(shown, "q[2]", 1.5)
        await page.wait(f"{row('q[2]', '.truth')}.startsWith('reports ')")
        for width in range(360, 1921, 40):
            await page.resize(width, 900)
            await page.wait(f"innerWidth === {width}")
            assert await page.run("document.documentElement.scrollWidth") <= width
            assert await page.run(OUTSIDE) == [], width


@pytest.mark.parametrize("width", [360, 768, 1280, 1920])
async def test_names_are_broken_behind_underscores_and_nothing_of_the_head_is_cut(
    plant: Plant, width: int
) -> None:
    mapping = CROWDED.replace("  safety:", "  stops: {robot: safety_status_bits, modbus: 106}\n  safety:")
    async with showing(plant, (width, 900), mapping=mapping) as shown:
        page = shown.page
        shown.simulator.do("set safety_status_bits 0xFFF")
        await page.wait(f"{row('stops', '.meaning')}.endsWith('stopped due to safety, 3PE input active')")
        assert await page.run(OUTSIDE) == []
        assert await page.run(BROKEN_WORDS) == []
        shown.simulator.kill()
        await page.wait(f"{text('#worst')} === '■ Robot'")
        cut = "[...document.querySelectorAll('header *')].filter((one) => one.scrollWidth > one.clientWidth + 1)"
        assert await page.run(f"{cut}.filter((one) => one.clientWidth > 0).map((one) => one.id)") == []


async def test_a_forced_value_shows_its_truth_and_the_time_left(plant: Plant) -> None:
    async with showing(plant, WIDE, mapping=CROWDED) as shown:
        page = shown.page
        force(shown, "mode", 3)
        await page.wait(f"{row('mode', 'span.value')} === '3'")
        await page.wait(f"{row('mode', '.meaning')} === 'power off'")
        await page.wait(f"{row('mode', '.truth')} === 'reports 7 running'")
        left = await page.run(row("mode", "span.quality"))
        assert left.startswith("forced, 5"), left
        assert left.endswith(" s left"), left
        shown.simulator.kill()
        await page.wait(f"{row('mode', '.truth')}.endsWith(', stale')")


async def test_a_forced_input_shows_what_the_robot_holds(plant: Plant) -> None:
    async with showing(plant, WIDE) as shown:
        page = shown.page
        force(shown, "part", 7)
        await page.wait(f"{row('part', '.truth')} === 'robot holds 7'")
        quiet = "document.querySelector('tr[data-quality=\"4\"] .truth').classList.contains('muted')"
        assert await page.run(quiet)
        await page.wait(f"{row('part', 'span.quality')}.endsWith(' s left')")
        shown.simulator.do("overwrite input_int_register_0 99")
        await page.wait(f"{row('part', '.truth')} === 'robot holds 99'")
        await page.wait(f"{row('part', 'span.quality')}.startsWith('differs in robot; forced, ')")
        assert await page.run(CONTRASTS) == []


async def test_a_thumb_finds_what_it_wants(plant: Plant) -> None:
    """The whole row opens on a phone; what can be tapped is high enough, and the filter does not enlarge the page."""
    async with showing(plant, NARROW) as shown:
        page = shown.page
        await page.wait("document.querySelector('#rows tr')")
        await page.run("document.querySelector('#rows td.value').scrollIntoView({block: 'center'})")
        hit = "(({x, y}) => document.elementFromPoint(x + 3, y + 3).className)"
        assert await page.run(f"{hit}(document.querySelector('td.value').getBoundingClientRect())") == "name"
        used = "[...document.querySelectorAll('.kind, .tabs button, #filter')].filter((one) => one.checkVisibility())"
        assert await page.run(f"{used}.filter((one) => one.clientHeight < 36).length") == 0
        size = "parseFloat(getComputedStyle(document.getElementById('filter')).fontSize)"
        assert await page.run(size) >= 16
        assert await page.run("getComputedStyle(document.querySelector('td.object')).display") == "none"


@pytest.mark.parametrize("stopped", [False, True], ids=["killed", "frozen"])
async def test_without_the_gateway_the_page_greys_and_says_since_when(plant: Plant, stopped: bool) -> None:
    """Also when connections are still accepted, by the kernel, and nothing answers."""
    async with showing(plant, NARROW, dark=True) as shown:
        page, daemon = shown.page, shown.daemon
        struck = (
            "getComputedStyle(document.querySelector('span.value')).textDecorationLine === 'line-through'"
        )
        await page.wait(f"!({struck})")
        daemon.popen.send_signal(19 if stopped else 9)
        await page.wait(LOST)
        await asyncio.sleep(0.5)
        assert await page.run(struck)
        assert await page.run(CONTRASTS) == [], "old, and still legible"
        assert "grayscale" in await page.run("getComputedStyle(document.querySelector('main')).filter")
        alarm = await page.run("document.getElementById('alarm').innerText")
        assert alarm.startswith("No answer from the gateway since ")
        if stopped:
            daemon.popen.send_signal(18)
            await page.wait(LIVE)
            await page.wait("document.getElementById('alarm').hidden")


async def test_force_and_release_need_a_second_click(plant: Plant) -> None:
    async with showing(plant, NARROW) as shown:
        page, plc = shown.page, shown.plc
        assert plc.write(10, [17]) == 0
        await page.wait(f"{row('part', 'span.owner')} === 'plc'")
        await sign_in(page, TOKEN)
        await page.wait(f"{text('#who')} === 'anna, engineer, until ' + {END}")
        await open_act(page, "part", "Force …")
        await page.wait("document.activeElement.id === 'act-value'")
        assert await page.run(NAMELESS) == []
        assert await page.run(DIALOG_CONTRASTS) == []
        await fill(page, value="4,5")
        await page.run("document.getElementById('act-go').click()")
        await page.wait(f"{text('#act-error')} === 'The value has to be a number, with a point: 1.5.'")
        await fill(page, value="1000")
        await confirm(page, "Force part from 17 to 1000")
        await page.wait(f"{text('#act-error')}.includes('out of limits')")
        assert plc.read(10) == [17], "nothing was forced so far"
        await fill(page, value="55")
        await page.run("document.getElementById('act-go').click()")
        await fill(page, value="56")
        await page.wait(f"{text('#act-go')} === 'Next'")
        await confirm(page, "Force part from 17 to 56 for 60 s.")
        await page.wait("!document.getElementById('act').open")
        await page.wait(f"{row('part', 'span.value')} === '56'")
        await open_act(page, "part", "End force …")
        await confirm(page, "End the force on part.")
        await page.wait(f"{row('part', 'span.owner')} === 'free'")
        assert plc.write(10, [18]) == 0
        await open_act(page, "part", "Release lock …")
        await confirm(page, "Release the lock part, which plc owns.")
        await page.wait(f"{row('part', 'span.owner')} === 'free'")
        await page.wait("!document.getElementById('act').open")
        assert plc.write(10, [19]) == 0
        await page.wait(f"{row('part', 'span.owner')} === 'plc'")
        await open_act(page, "part", "Take lock …")
        await fill(page, seconds="soon")
        await page.run("document.getElementById('act-go').click()")
        await page.wait(f"{text('#act-error')} === 'The time has to be a number of seconds.'")
        await fill(page, seconds="90")
        await confirm(page, "Take the lock part from plc for 90 s.")
        await page.wait(f"{row('part', 'span.owner')}.startsWith('operator (token anna), ')")
        assert plc.write(10, [21]) == 6
        await page.wait(f"{text('#owned')}.includes('operator (token anna)')")
        await open_act(page, "part", "Take lock …")
        await fill(page, seconds="")
        await confirm(page, "Keep the lock part until it is released.")
        await page.wait(f"{row('part', 'span.owner')} === 'operator (token anna)'")
        await open_act(page, "part", "Release lock …")
        await confirm(page, "Release the lock part, which the operator (token anna) owns.")
        await page.wait(f"{row('part', 'span.owner')} === 'free'")
        shown.daemon.kill()
        await page.wait(LOST)
        await open_act(page, "part", "Force …")
        await fill(page, value="1")
        await confirm(page, "Force part")
        await page.wait(f"{text('#act-error')} === 'The gateway does not answer: nothing was sent.'")


async def test_who_may_do_what(plant: Plant) -> None:
    """What the role lacks is disabled with the reason; a revoked token is signed out, and what it held has ended."""
    async with showing(plant, NARROW) as shown:
        page, tokens = shown.page, plant.directory / "tokens"
        await page.wait("document.getElementById('sign-in').checkVisibility()")
        await open_details(page, "part")
        await page.wait(f"{text('.detail .lack')} === 'Sign in to do this.'")
        assert (
            await page.run(
                "[...document.querySelectorAll('.detail .acts button')].filter((one) => !one.disabled).length"
            )
            == 0
        )
        await page.run("document.getElementById('sign-in').click()")
        assert await page.run(NAMELESS) == []
        await enter(page, "not the token")
        await page.wait(f"{text('#token-error')}.startsWith('Not signed in: the token is not one of')")
        assert await page.run(DIALOG_CONTRASTS) == []
        assert await page.run("sessionStorage.length + document.cookie.length") == 0
        operator = token("bert", Role.OPERATOR, "token of bert", 3 * 86400)
        write_tokens(tokens, operator)
        await counts(shown, "token of bert")
        await enter(page, "token of bert")
        await page.wait(f"{text('#who')} === 'bert, operator'")
        lack = "This needs the role engineer; bert is operator."
        await page.wait(f"{text('.detail .lack')} === '{lack}'")
        await open_act(page, "part", "Take lock …")
        await fill(page, seconds="")
        await confirm(page, "Take the lock part")
        await page.wait(f"{row('part', 'span.owner')} === 'operator (token bert)'")
        assert await page.run(CONTRASTS) == []
        assert await page.run("[location.href, document.cookie].join('').includes('token')") is False
        write_tokens(tokens)
        await page.wait(f"{text('#token-error')}.startsWith('Signed out: the token is not one of')")
        write_tokens(tokens, operator)
        await counts(shown, "token of bert")
        await enter(page, "token of bert")
        await page.wait(f"{row('part', 'span.owner')} === 'free'")
        await page.wait(f"{text('#happened')}.includes('the token bert was revoked')")
        await page.run("document.getElementById('sign-out').click()")
        await page.wait("document.getElementById('sign-in').checkVisibility()")
        assert await page.run("sessionStorage.length") == 0


async def counts(shown: Shown, given: str) -> None:
    """Return when the gateway has read the file in which this token is."""
    async with aiohttp.ClientSession(headers={"Authorization": f"Bearer {given}"}) as session:
        while True:
            async with session.get(f"{shown.url}page/session") as answer:
                if answer.status == 200:
                    return


async def sign_in(page: Page, given: str) -> None:
    await page.wait("document.getElementById('sign-in').checkVisibility()")
    await page.run("document.getElementById('sign-in').click()")
    await enter(page, given)
    await page.wait("!document.getElementById('session').open")


async def enter(page: Page, given: str) -> None:
    await page.wait("document.getElementById('session').open")
    await page.run(f"document.getElementById('token').value = {json.dumps(given)}")
    await page.run("document.getElementById('token-go').click()")


async def open_details(page: Page, name: str) -> None:
    await page.wait("document.querySelector('#rows tr')")
    await page.run(
        f"(([button]) => button.ariaExpanded === 'true' || button.click())"
        f"([...document.querySelectorAll('button.name')].filter((one) => one.textContent === '{name}'))"
    )


async def open_act(page: Page, name: str, act: str) -> None:
    """Open the variable's details, if they are not, and the dialog of an act."""
    await open_details(page, name)
    button = (
        f"[...document.querySelectorAll('.detail .acts button')].find((one) => one.textContent === '{act}')"
    )
    await page.wait(f"{button}.checkVisibility()")
    await page.run(f"{button}.click()")


async def fill(page: Page, **fields: str) -> None:
    for name, value in fields.items():
        field = f"document.getElementById('act-{name}')"
        await page.run(f"{field}.value = {json.dumps(value)}; {field}.dispatchEvent(new Event('input'))")


async def confirm(page: Page, says: str) -> None:
    """The first click says it, the second does it."""
    await page.run("document.getElementById('act-go').click()")
    await page.wait(f"{text('#act-says')}.startsWith({json.dumps(says)})")
    await page.run("document.getElementById('act-go').click()")


async def test_what_belongs_together_has_a_label_that_folds_it(plant: Plant) -> None:
    """A group that is owned as one, and the elements of a vector; a folded label says what is not good in it."""
    async with showing(plant, WIDE, mapping=CROWDED) as shown:
        page = shown.page
        labels = "[...document.querySelectorAll('.group:not([hidden]) td')].map((label) => label.textContent).join()"
        await page.wait(f"{labels} === 'motion2 variables, owned together,q6 variables'")
        lines = "[...document.querySelectorAll('#rows tr:not(.group)')].filter((line) => !line.hidden).length"
        assert await page.run(lines) == 12
        await page.run("document.querySelectorAll('.fold')[1].click()")
        assert await page.run(lines) == 6
        assert await page.run("document.querySelectorAll('.fold')[1].ariaExpanded") == "false"
        force(shown, "q[2]", 1.5)
        await page.wait(f"{labels}.endsWith('q6 variables▲ 1 not good')")
        assert await page.run(CONTRASTS) == []
        await page.resize(*NARROW)
        assert await page.run(OUTSIDE) == []


async def test_the_keyboard_goes_through_the_page_in_reading_order(plant: Plant) -> None:
    async with showing(plant, WIDE, mapping=CROWDED) as shown:
        page = shown.page
        assert await page.run("document.querySelectorAll('[tabindex]:not([tabindex=\"0\"])').length") == 0
        assert await page.run(OUT_OF_ORDER) == []
        assert await page.run(HEADINGS_OF_SECTIONS) == "H1 H2"
        assert await page.run("document.documentElement.lang") == "en"


async def test_the_plots_begin_before_the_page_was_opened(plant: Plant) -> None:
    """The gateway keeps a minute: a peak that nobody looked at is there."""
    async with showing(plant, WIDE) as shown:
        page = shown.page
        assert shown.plc.write(10, [900]) == 0
        await page.wait(f"{row('part', 'span.value')} === '900'")
        peak = f"fetch('{shown.url}page/cells/cell/history').then((answer) => answer.json())"
        await page.wait_for(f"{peak}.then(({{samples}}) => samples.some(({{values}}) => values[1] === 900))")
        assert shown.plc.write(10, [5]) == 0
        await page.wait(f"{row('part', 'span.value')} === '5'")
        await page.open(shown.url, *WIDE)
        await page.wait(f"{LIVE} && {row('part', 'span.value')} === '5'")
        await page.run(
            "[...document.querySelectorAll('button.name')].find((one) => one.textContent === 'part').click()"
        )
        await page.wait(f"{text('.detail .axis')}.includes('highest 900')")


async def test_a_reloaded_mapping_is_shown_without_reloading_the_page(plant: Plant) -> None:
    async with showing(plant, WIDE) as shown:
        plant.mapping(MAPPING.replace("cycles:", "made:"), shown.simulator.port)
        shown.daemon.popen.send_signal(1)
        await shown.page.wait(f"{row('made', 'span.quality')}.startsWith('good')")


async def test_one_page_shows_all_cells_at_a_glance(plant: Plant) -> None:
    """A robot that is dead in a cell that nobody looks at is seen from every other one."""
    simulators, port = [plant.simulator(), plant.simulator()], free_port()
    outputs = "variables:\n  {name}: {{robot: output_int_register_0, modbus: 110}}\n"
    files = [
        plant.mapping(outputs.format(name=f"cycles_{unit}"), simulator.port, name=f"cell-{unit}", unit=unit)
        for unit, simulator in enumerate(simulators, 1)
    ]
    plant.daemon(*files, "--status", f"{HOST}:{port}").wait_for_line("status page")
    async with browsing() as page:
        await page.open(f"http://{HOST}:{port}/", *NARROW)
        await page.wait(f"{LIVE} && {text('button.name')} === 'cycles_1'")
        levels = "[...document.querySelectorAll('#cells a')].map((link) => link.dataset.level).join()"
        await page.wait(f"{levels} === 'good,good'")
        assert await page.run("document.title") == "● cell-1 - gatewayd"
        simulators[1].kill()
        await page.wait(f"{levels} === 'good,bad'")
        await page.wait(f"{text('#cells li:nth-child(2) .why')}.startsWith('robot not connected')")
        await page.wait("document.title === '■ cell-1 - gatewayd'")
        assert await page.run(text("#worst")) == "■ cell-2"
        assert await page.run("document.querySelector('.node.robot').dataset.level") == "good"
        assert await page.run("document.documentElement.scrollWidth") <= NARROW[0]
        await page.run("document.querySelector('#cells li:nth-child(2) a').click()")
        await page.wait(f"{LIVE} && {text('button.name')} === 'cycles_2'")
        assert await page.run(text("#cells [aria-current] strong")) == "cell-2"
        assert await page.run(CONTRASTS) == []
        assert page.problems == []


async def test_filter_and_details_by_keyboard_alone(plant: Plant) -> None:
    async with showing(plant, WIDE) as shown:
        page = shown.page
        await page.press("/", 191)
        assert await page.run("document.activeElement.id") == "filter"
        for key in "4001":
            await page.press(key)
        visible = "[...document.querySelectorAll('#rows tr:not(.group)')].filter((row) => !row.hidden).length"
        await page.wait(f"{visible} === 7")
        assert await page.run(text("#shown")) == "7 of 9"
        await page.press("Escape", 27)
        await page.wait(f"{visible} === 9")
        await page.run("document.querySelector('button.name').focus()")
        await page.press("Enter", 13)
        await page.wait("document.querySelector('.detail canvas.plot').clientHeight > 100")
        assert "begin one cycle" in await page.run(text(".detail dl"))
        assert await page.run("document.querySelector('button.name').getAttribute('aria-expanded')") == "true"
        drawn = "canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some(Boolean)"
        await page.wait(f"((canvas) => {drawn})(document.querySelector('.detail canvas'))")


async def test_nothing_sticks_out_and_everything_can_be_read(plant: Plant) -> None:
    """No sideways scrolling; text has the contrast that WCAG 2 AA asks for; what can be used has a name."""
    async with showing(plant, NARROW) as shown:
        page = shown.page
        for size in (NARROW, WIDE):
            for dark in (False, True):
                await page.open(shown.url, *size, dark=dark)
                await page.wait(f"{LIVE} && document.querySelector('#rows tr')")
                assert await page.run("document.documentElement.scrollWidth") <= size[0]
                assert await page.run(CONTRASTS) == [], (size, dark)
                assert await page.run(NAMELESS) == []


BUS_OFF = """
(() => {
  const { json } = Response.prototype;
  Response.prototype.json = async function () {
    const found = await json.call(this);
    const off = { level: "bad", words: "bus-off: wiring, termination or bit rate" };
    if (found.picture) Object.assign(found.picture.buses[1], off);
    return found;
  };
})()
"""
HEADINGS = "[...document.querySelectorAll('thead th')].filter((one) => one.checkVisibility()).length"
OUTSIDE = """
(() => {
  const card = document.getElementById("variables").getBoundingClientRect();
  return [...document.querySelectorAll("#variables td, #variables td *, #variables th")]
    .filter((one) => one.checkVisibility() && getComputedStyle(one.closest("thead") ?? one).position !== "absolute")
    .filter((one) => one.getBoundingClientRect().right > card.right + 0.5)
    .map((one) => `${one.className} ${one.textContent}`);
})()
"""
BROKEN_WORDS = """
(() => {
  const lines = (node, start, end) => {
    const range = document.createRange();
    range.setStart(node, start);
    range.setEnd(node, end);
    return new Set([...range.getClientRects()].map(({ top }) => Math.round(top))).size;
  };
  const broken = (node) => [...node.data.matchAll(/\\S+/g)]
    .filter(({ 0: word, index }) => lines(node, index, index + word.length) > 1)
    .map(({ 0: word }) => word);
  return [...document.querySelectorAll("#variables td.name :is(button, span), #picture strong")]
    .filter((one) => one.checkVisibility())
    .flatMap((one) => [...one.childNodes].filter((node) => node.nodeType === 3).flatMap(broken));
})()
"""
CONTRASTS = """
(() => {
  const parts = (color) => color.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((c) => (c /= 255) <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
    .reduce((sum, c, at) => sum + c * [0.2126, 0.7152, 0.0722][at], 0);
  const ground = (element) => {
    for (; element; element = element.parentElement) {
      const hatch = getComputedStyle(element).backgroundImage.match(/rgb\\([^)]*\\)/);
      if (hatch) return parts(hatch[0]);
      const color = parts(getComputedStyle(element).backgroundColor);
      if (color.length === 3 || color[3] === 1) return color;
    }
    return [255, 255, 255];
  };
  const bad = new Set();
  for (const element of document.querySelectorAll("main *, header *")) {
    const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    if (!own || !element.checkVisibility() || element.closest("svg")) continue;
    const [a, b] = [light(parts(getComputedStyle(element).color)), light(ground(element))].sort((x, y) => y - x);
    const contrast = (a + 0.05) / (b + 0.05);
    if (contrast < 4.5) bad.add(`${element.className || element.tagName} ${contrast.toFixed(1)}`);
  }
  return [...bad];
})()
"""
OUT_OF_ORDER = """
(() => {
  const places = [...document.querySelectorAll("#variables :is(button, input)")].filter((one) => one.checkVisibility())
    .map((one) => one.getBoundingClientRect());
  return places.slice(1).filter((place, at) => place.bottom < places[at].top).map((place) => place.top);
})()
"""
HEADINGS_OF_SECTIONS = (
    "[...document.querySelectorAll('h1, h2, h3, h4')].filter((one) => one.checkVisibility())"
    ".map((one) => one.tagName).join(' ')"
)
DIALOG_CONTRASTS = CONTRASTS.replace("main *, header *", "dialog *")
NAMELESS = """
[...document.querySelectorAll("button, input, select, a, [tabindex]")]
  .filter((element) => element.checkVisibility())
  .filter((element) => !(element.textContent.trim() || element.getAttribute("aria-label") || element.labels?.length))
  .map((element) => element.outerHTML)
"""
