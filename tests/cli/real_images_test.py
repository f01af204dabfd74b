"""All measured depth images there are: how many of them `fit` finds the hand in."""

import unittest

import fit_test


class AllImages(fit_test.RealImages):
    def test_stretched_fingers_turned_in_the_image(self):
        found, images = self.found("a")
        self.assertEqual(images, 8)
        self.assertGreaterEqual(found, 7)

    def test_bent_fingers(self):
        found, images = self.found("b")
        self.assertEqual(images, 11)
        self.assertGreaterEqual(found, 9)


if __name__ == "__main__":
    unittest.main()
