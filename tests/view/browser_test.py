"""The pages of results in Debian's chromium, which draws by software: opened from disk, wide and as a telephone.

TOUCHFIELD_SCREENSHOTS: a folder for pictures of the pages."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import h5py
    import numpy
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.wait import WebDriverWait
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)
MISSING = [name for name in ("chromium", "chromedriver") if not shutil.which(name)]
if MISSING:
    print(f"skipped: {', '.join(MISSING)} not there: apt-get install chromium-driver python3-selenium")
    sys.exit(77)

PROGRAM = os.environ["TOUCHFIELD_PROGRAM"]
SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
PICTURES = os.environ.get("TOUCHFIELD_SCREENSHOTS")

CASES = (("run", "quick"), ("run", "width_8mm"), ("play", "moving"), ("pattern", "circle"))

# Colours of the canvas, each counted once, and a sum that another picture would hardly have.
PIXELS = """
const gl = page.viewer.gl, bytes = new Uint8Array(4 * page.canvas.width * page.canvas.height);
page.draw();
gl.readPixels(0, 0, page.canvas.width, page.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
const colours = new Set();
let sum = 0;
for (let i = 0; i < bytes.length; i += 4) {
  colours.add(bytes[i] << 16 | bytes[i + 1] << 8 | bytes[i + 2]);
  sum = (31 * sum + bytes[i] + 7 * bytes[i + 1] + 13 * bytes[i + 2]) % 1000000007;
}
return [colours.size, sum];"""


def browser(*more):
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--hide-scrollbars",
                     "--enable-unsafe-swiftshader", "--window-size=1400,1000", *more):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)


class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-view-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        for command, scene in CASES:
            subprocess.run([PROGRAM, command, SOURCE / f"scenes/{scene}.yaml", "-o", cls.folder / scene], check=True,
                           capture_output=True)
        subprocess.run([PROGRAM, "felt", cls.folder / "quick", "-o", cls.folder / "felt"], check=True, capture_output=True)
        cls.browser = browser()
        cls.addClassCleanup(cls.browser.quit)

    def open(self, scene, width=1400, height=1000, page="report.html"):
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})
        self.browser.get((self.folder / scene / page).as_uri())
        self.wait("return document.documentElement.dataset.frames > 0")
        self.picture(f"{scene}_{width}")

    def run_script(self, script):
        return self.browser.execute_script(script)

    def wait(self, script):
        WebDriverWait(self.browser, 30).until(lambda b: b.execute_script(script))

    def picture(self, name):
        if PICTURES:
            self.browser.save_screenshot(f"{PICTURES}/view_{name}.png")

    def choose(self, select, value):
        self.browser.find_element(By.CSS_SELECTOR, f"#{select} option[value='{value}']").click()
        self.browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")  # it is drawn

    def test_pages_open_from_disk(self):
        for command, scene in CASES:
            for width, height in ((1400, 1000), (400, 850)):
                with self.subTest(scene=scene, width=width):
                    self.open(scene, width, height)
                    self.assertGreater(self.run_script(PIXELS)[0], 100)
                    self.assertLessEqual(self.run_script("return document.documentElement.scrollWidth"), width)
                    self.assertEqual(self.run_script("return performance.getEntriesByType('resource').length"), 0)
                    self.assertEqual(self.browser.get_log("browser"), [])
                    if command == "run":
                        self.assertLess((self.folder / scene / "report.html").stat().st_size, 6e6)
                    print(scene, width, "ready after", self.run_script("return document.documentElement.dataset.ready"), "ms")

    def test_every_method_and_quantity_has_a_picture_of_its_own(self):
        self.open("quick")
        sums = set()
        for quantity in range(4):
            self.choose("quantity", quantity)
            for method in range(3):
                self.choose("method", method)
                colours, checksum = self.run_script(PIXELS)
                self.assertGreater(colours, 100)
                sums.add(checksum)
        self.assertEqual(len(sums), 12)
        self.choose("method", "wanted")
        self.assertGreater(self.run_script(PIXELS)[0], 20)

    def test_the_value_under_the_pointer_is_the_file_s(self):
        for scene in ("quick", "width_8mm"):
            with h5py.File(self.folder / scene / "run.h5") as file:
                methods = file["evaluation/methods"]
                known = {name: (numpy.abs(group["pressure"][:]), group["radiation"][:])
                         for name, group in methods.items()}
            self.open(scene)
            stage = self.browser.find_element(By.ID, "stage")
            for quantity, of in ((0, 1), (1, 0)):
                self.choose("quantity", quantity)
                for method in range(3):
                    self.choose("method", method)
                    for x, y in ((0, 0), (37, 61), (-80, -40)):
                        ActionChains(self.browser).move_to_element_with_offset(stage, x, y).perform()
                        tip = self.run_script("return {...document.getElementById('tip').dataset}")
                        values = known[tip["method"]][of]
                        self.assertAlmostEqual(float(tip["value"]), values[int(tip["face"])], delta=0.01 * values.max())

    def test_the_vibration_under_the_pointer_is_the_file_s(self):
        self.open("felt", page="felt.html")
        self.assertIn("a share of correct answers", self.browser.find_element(By.TAG_NAME, "body").text)
        with h5py.File(self.folder / "felt/felt.h5") as file:
            faces, places = file["patch/faces"][:].tolist(), file["patch/places"][:] / file["patch"].attrs["step"] + 24
            methods = {name: (group["radiation_rms"][:], *(group[f"skins/{skin}/displacement"][:]
                                                          for skin in ("soft", "middle", "stiff")))
                       for name, group in file["methods"].items()}
        stage, off = self.browser.find_element(By.ID, "stage"), 0
        for quantity in range(4):
            self.choose("quantity", quantity)
            self.assertGreater(self.run_script(PIXELS)[0], 100)
            self.choose("method", quantity % len(methods))
            for x, y in ((0, 0), (37, 61), (-40, -40), (0, 220)):
                ActionChains(self.browser).move_to_element_with_offset(stage, x, y).perform()
                self.assertIn((" Pa at ", " um at ")[quantity > 0], self.browser.find_element(By.ID, "tip").text)
                tip = self.run_script("return {...document.getElementById('tip').dataset}")
                if int(tip["face"]) not in faces:
                    self.assertEqual(tip["value"], "NaN")
                    off += 1
                    continue
                at, values = faces.index(int(tip["face"])), methods[tip["method"]][quantity]
                (i, j), (a, b) = places[at].astype(int), places[at] % 1
                wanted = values[at] if quantity == 0 else [1 - b, b] @ values[j:j + 2, i:i + 2] @ [1 - a, a]
                self.assertAlmostEqual(float(tip["value"]), wanted, delta=0.01 * numpy.nanmax(values))
        self.assertEqual(off, 4)

    def test_keys_turn_move_zoom_and_read(self):
        self.open("quick")
        canvas = self.browser.find_element(By.CSS_SELECTOR, "#stage canvas")
        seen = {self.run_script(PIXELS)[1]}
        for keys in (Keys.ARROW_LEFT, Keys.SHIFT + Keys.ARROW_UP, "+"):
            canvas.send_keys(keys)
            seen.add(self.run_script(PIXELS)[1])
        self.assertEqual(len(seen), 4)
        canvas.send_keys(Keys.ENTER)
        self.assertRegex(self.browser.find_element(By.ID, "tip").text, r"^wanted: .* Pa; surface: .* Pa; .* at .* mm$")

    def test_time_moves_by_slider_and_play_alone(self):
        for scene in ("moving", "circle"):
            self.open(scene)
            frames = self.run_script("return document.documentElement.dataset.frames")
            clock, before = self.browser.find_element(By.ID, "clock").text, self.run_script(PIXELS)
            self.run_script("return new Promise(done => setTimeout(done, 700))")
            self.assertLessEqual(int(self.run_script("return document.documentElement.dataset.frames")), int(frames) + 1)
            for _ in range(5):
                self.browser.find_element(By.ID, "time").send_keys(Keys.ARROW_RIGHT)
            self.assertNotEqual(self.browser.find_element(By.ID, "clock").text, clock)
            self.assertNotEqual(self.run_script(PIXELS), before)
            self.assertTrue(self.browser.find_elements(By.CSS_SELECTOR, "#diagrams .marker"))
            self.browser.find_element(By.XPATH, "//button[text()='play']").click()
            self.wait("return page.state.skin >= 7")
            self.browser.find_element(By.XPATH, "//button[text()='stop']").click()

    def test_without_webgl_the_overview_stands_in(self):
        plain = browser("--disable-3d-apis")
        self.addCleanup(plain.quit)
        plain.get((self.folder / "quick/report.html").as_uri())
        self.assertTrue(plain.find_element(By.CSS_SELECTOR, "#instead img").is_displayed())
        self.assertIn("no WebGL 2", plain.find_element(By.ID, "instead").text)
        self.assertFalse(plain.find_element(By.ID, "view").is_displayed())


if __name__ == "__main__":
    unittest.main()
