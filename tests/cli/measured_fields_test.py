"""Fields that others scanned: the radius of the microphone is fitted on two maps and held on a third. Skipped without their data."""

import pathlib
import unittest

from support import PROGRAM, CommandTest, script


FIELDS = script("measured_fields")


class MeasuredFields(CommandTest):
    @unittest.skipUnless(FIELDS.data_folder().is_dir(), f"no folder {FIELDS.data_folder()}; TOUCHFIELD_DATA names its parent")
    def test_a_map_is_met_with_the_microphone_of_others(self):
        program = FIELDS.Program(pathlib.Path(PROGRAM).resolve(), self.folder)
        rows = FIELDS.measure(FIELDS.data_folder(), program, ["HeightMod_Star"])
        at = FIELDS.COLUMNS.index
        plain, held = ({row[0]: row for row in rows[first::2]} for first in (0, 1))
        for name, point, disc in [("HeightMod_A", 0.89, 0.93), ("HeightMod_12", 0.92, 0.95), ("HeightMod_Star", 0.93, 0.95)]:
            self.assertGreater(plain[name][at("correlation")], point)
            self.assertGreater(held[name][at("correlation")], disc)
        for name in FIELDS.FITTED:
            self.assertAlmostEqual(held[name][at("receiver_mm")], 5.5, delta=1.0)


if __name__ == "__main__":
    unittest.main()
