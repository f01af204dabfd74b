"""The tutorials that tutorials_test.py leaves out."""

import unittest

import tutorials_test


class LongTutorials(tutorials_test.Following):
    pass


tutorials_test.add_tests(LongTutorials, tutorials_test.LONG)

if __name__ == "__main__":
    unittest.main()
