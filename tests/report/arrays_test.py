"""Sentences on patterns in time, tolerances and other arrays, from small tables."""

import pathlib
import tempfile
import unittest
import unittest.mock

import report_support  # noqa: F401

import arrays

TABLES = {
    "patterns.csv": "# made by: scripts/tables patterns; revision: abc\n"
                    "pattern,frames,error,above_mean,turn_deg,phases_s\n"
                    "circle,1000,0.79,-0.04,177,12\nthe same at most 5 degrees,1000,0.8,3.0,5,11\ncircle of 10,10,0.81,2.5,179,2\n"
                    "line,100,0.78,0.3,90,4\n",
    "robust.csv": "# made by: scripts/tables robust; revision: abc\n"
                  "phase_deg,gain_percent,dead_percent,plain,robust\n10,5,0,0.53,0.5\n20,10,0,0.676,0.549\n20,10,2,0.7,0.56\n",
    "array_designs.csv": "# made by: scripts/tables array_designs; revision: abc\n"
                         "rank,family,name,transducers,error_surface,error_bound,error_with_amplitudes,width_mm_with_amplitudes\n"
                         "1,dense,one,1400,0.6,0.331,0.344,7.0\n2,dense,two,1450,0.62,0.32,0.349,6.9\n3,flat,three,1496,0.43,0.41,0.42,5.4\n",
}


class Texts(unittest.TestCase):
    def test_sentences_follow_the_tables(self):
        with tempfile.TemporaryDirectory() as folder, unittest.mock.patch.object(arrays, "TABLES", pathlib.Path(folder)):
            for name, text in TABLES.items():
                (pathlib.Path(folder) / name).write_text(text)
            patterns, pattern_rows, robust, _, layouts, layout_rows = arrays.texts()
        self.assertIn("0.0 to 0.3 points above", patterns)  # without limited and short paths
        self.assertIn("scripts/tables patterns; revision: abc", patterns)
        self.assertEqual(pattern_rows.count("\n"), 5)
        self.assertIn("| circle of 10 | 10 | 81.0 % | 2.5 | 179 | 2 |", pattern_rows)
        self.assertIn("54.9 % instead of 67.6 %", robust)
        self.assertIn("Among 3 layouts of at most 1,500 transducers, the lowest error with phases alone is 43.0 %", layouts)
        self.assertIn("With amplitudes it is 34.4 %. By the optimality bounds, no layout can reach less than 32.0 %", layouts)
        self.assertIn("| dense | one | 1400 | 60.0 % | 34.4 % | 33.1 % | 7.0 |", layout_rows)


if __name__ == "__main__":
    unittest.main()
