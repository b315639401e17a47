"""The script that makes Fortran from the table of namelist entries: test_make_entries.py FOLDER_OF_CONFIG."""

import inspect
import json
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv.pop(1))
from generator.manual import manual  # noqa: E402
from generator.package import update_package  # noqa: E402
from generator.pairs import pair_module, value_module  # noqa: E402
from generator.settings import fill_module, lone_modules, settings_module, table_module  # noqa: E402
from generator.table import TableError, read_table  # noqa: E402

GOOD = """# Comment
list ways = slow fast
group walk: how it goes
walk | way | word | 1 | slow | - | {ways} none | - | Way to go
walk | steps | integer | 2 | 0, 0 | m | >= 0 | way: {ways} | Steps, don't count
walk | steps | integer | 2 | required | m | > 0 | way: none | Steps
group dog *: who comes along
dog | name | name | 1 | required | - | - | - | Name of the dog
dog | friends | name | 2 | required | - | dog | - | Other dogs
group wall *: what is in the way
wall | name | name | 1 | required | - | - | - | Name of the wall
wall | height | real | 1 | 1 | m | - | - | Height
group bag
bag | names | path | 0 | - | - | - | - | Names
"""

PAIRS = """group forces
forces | glue | real | 1 | 2 | N | > 0 | - | Glue; 0: none | <= 9: in mN? | harmonic mean
forces | wear | real | 1 | 0 | - | >= 0 | - | Wear | - | smaller one
group material *: what bodies consist of
material | name | name | 1 | required | - | - | - | Name
group contact_pair *: contacts
contact_pair | name | name | 1 | required | - | - | - | Name
contact_pair | materials | name | 2 | required | - | material | - | Both
"""


class TestMakeEntries(unittest.TestCase):
    """One row makes a row, a component and a line that fills it; a bad row is named."""

    def test_one_row_makes_all(self):
        table = read_table(GOOD)
        row = "entry_t('walk', 'way', 'word', 1, 'slow', '', &\n         'slow fast none'"
        self.assertIn(row, table_module(*table))
        self.assertIn("'Steps, don''t count'", table_module(*table))
        self.assertEqual(settings_module(*table).count(":: steps(2) = 0_ip"), 1)
        self.assertIn("type(text_t), allocatable :: names(:)", settings_module(*table))
        self.assertEqual(fill_module(*table).count("settings%steps = &"), 1)
        self.assertIn("settings%steps = &\n         instance%values(row_of(instance, 'steps'))%integers\n",
                      fill_module(*table))
        self.assertIn("| &walk | `way` | word | | `'slow'` | slow, fast, none | | Way to go |\n", manual(table[1]))
        self.assertIn("| 2 integers | m | required | > 0 | way = none | Steps |\n", manual(table[1]))

    def test_a_repeatable_group_makes_an_array(self):
        table = read_table(GOOD)
        self.assertIn("type(dog_settings_t), allocatable :: dog(:)", settings_module(*table))
        self.assertIn("type(walk_settings_t) :: walk\n", settings_module(*table))
        self.assertIn("allocate (settings%dog(count(instances%group == 'dog')))", fill_module(*table))
        self.assertIn("call fill_dog(instances(k), settings%dog(instances(k)%number))", fill_module(*table))
        self.assertIn("| &dog | `name` | name | | required | at most 64 letters, digits, _ | | Name", manual(table[1]))
        self.assertIn("| &dog | `friends` | 2 names | | required | name of a &dog | | Other", manual(table[1]))

    def test_a_part_can_be_stored_back(self):
        made = fill_module(*read_table(GOOD))
        self.assertIn("subroutine store_wall(settings, instance)", made)
        self.assertIn("call store_value(instance, 'name', text=settings%name)", made)
        self.assertIn("call store_value(instance, 'height', reals=[settings%height])", made)
        self.assertNotIn("subroutine store_dog", made)

    def test_a_usual_range_stands_in_the_table_and_in_the_manual(self):
        table = read_table(GOOD.replace("| Height", "| Height | <= 3 or > 9: in mm?"))
        self.assertIn("'Height', &\n         '<= 3 or > 9', &\n         'in mm?')", table_module(*table))
        self.assertIn("'Name of the wall')", table_module(*table))
        self.assertIn("| `height` | real | m | 1 | > 0; usual: <= 3 or > 9 | | Height |\n",
                      manual(read_table(GOOD.replace("| m | - | - | Height",
                                                     "| m | > 0 | - | Height | <= 3 or > 9: in mm?"))[1]))

    def test_a_number_of_pairs_has_one_row(self):
        _, rows = read_table(PAIRS)
        self.assertEqual([row.group + "." + row.key for row in rows if row.key in ("glue", "wear")],
                         ["forces.glue", "forces.wear", "material.glue", "material.wear", "contact_pair.glue",
                          "contact_pair.wear"])
        page = manual(rows)
        self.assertIn("| &forces | `glue` | real | N | 2 | > 0; usual: <= 9 | | Glue; 0: none |", page)
        self.assertIn("| &material | `glue` | real | N | | > 0; usual: <= 9 | | Glue; of two materials: harmonic", page)
        self.assertIn("| &contact_pair | `wear` | real | | | >= 0 | | Wear |", page)
        made = pair_module(rows)
        self.assertIn("integer, parameter :: at_wear = 2", made)
        self.assertIn("mixed(1) = 2.0_wp*min(a(1), b(1))*(max(a(1), b(1))/(a(1) + b(1)))", made)
        self.assertIn("mixed(2) = min(a(2), b(2))", made)
        self.assertIn("if (allocated(group%wear)) values(2) = group%wear", made)
        self.assertIn("      !> Glue [N]\n      type(pair_value_t) :: glue\n", value_module(rows))
        self.assertIn("pairs%wear = new_pair_value(table(:, :, 2), one(2))", value_module(rows))

    def test_groups_include_a_block(self):
        text = ("block size: how large\nsize | way | word | 1 | wide | - | wide high | - | Way\n"
                "size | width | real | 1 | 2 | m | > 0 | way: wide | Width\n"
                "group box *: boxes\nbox | name | name | 1 | required | - | - | - | Name\ninclude size\n"
                "group lid\nlid | width | real | 1 | 3 | m | > 0 | - | Width of the lid\ninclude size\n")
        groups, rows = read_table(text)
        self.assertEqual([f"{row.group}.{row.key} {row.default}" for row in rows],
                         ["box.name required", "box.way wide", "box.width 2", "lid.width 3", "lid.way wide"])
        made = settings_module(groups, rows)
        self.assertIn("type :: size_settings_t\n      !> Way\n", made)
        self.assertIn("type, extends(size_settings_t) :: box_settings_t\n      !> Name\n      character(len=:), "
                      "allocatable :: name\n   end type", made)
        self.assertEqual(made.count("real(wp) :: width"), 1)
        text = text.replace("group box", "block room: larger\nroom | height | real | 1 | 4 | m | > 0 | - | Height\n"
                            "include size\ngroup hall\nhall | way | word | 1 | - | - | a wide | - | Way\n"
                            "include room with way: a\ngroup box")
        groups, rows = read_table(text)
        self.assertEqual([f"{row.key} {row.needs}" for row in rows if row.group == "hall"],
                         ["way ", "height way: a", "width way: a"])
        self.assertRegex(settings_module(groups, rows), r"(?s) :: size_settings_t\n.* extends\(size_settings_t\) :: "
                         r"room_settings_t\n      !> Height.* extends\(room_settings_t\) :: hall_settings_t\n\n   end")
        with self.assertRaisesRegex(TableError, "line 6: there is no block sice above it"):
            read_table(text.replace("include size\ngroup", "include sice\ngroup"))

    def test_a_group_that_stands_alone_has_modules_of_its_own(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "other.txt").write_text(GOOD, encoding="utf-8")
            made = lone_modules(*read_table("lists other.txt\nlist more = {ways} none\ngroup race: who is first\n"
                                            "race | way | word | 0 | required | - | {more} | - | Ways\n"
                                            "race | laps | integer | 1 | 3 | - | > 0 | - | Laps\n", Path(folder)))
        self.assertEqual(list(made), ["race_table", "race_settings", "fill_race"])
        self.assertIn("'slow fast none'", made["race_table"])
        self.assertIn("module polydem_race_table\n", made["race_table"])
        self.assertIn("type, extends(source_locations_t) :: race_settings_t\n", made["race_settings"])
        self.assertIn("use polydem_kinds, only: ip\n", made["race_settings"])
        self.assertIn("   public :: fill_race\n", made["fill_race"])

    def test_the_package_knows_the_entries(self):
        groups, rows = read_table(GOOD.replace("Steps, don't", "Steps \"a\\b\", don't").replace("names", "from"))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            self.assertEqual(update_package(folder, groups, rows, True), ["schema.json", "settings.py"])
            self.assertEqual(list(folder.iterdir()), [])
            update_package(folder, groups, rows, False)
            self.assertEqual(update_package(folder, groups, rows, True), [])
            made = json.loads((folder / "schema.json").read_text(encoding="utf-8"))["properties"]
            source = (folder / "settings.py").read_text(encoding="utf-8")
            (folder / "settings.py").write_text(source + "\n", encoding="utf-8")
            self.assertEqual(update_package(folder, groups, rows, True), ["settings.py"])
        self.assertEqual(list(made), list(groups))
        walk, dog = made["walk"]["properties"], made["dog"]["additionalProperties"]["properties"]
        self.assertEqual(walk["way"], {"type": "string", "enum": ["slow", "fast", "none"], "default": "slow",
                                       "description": "Way to go; default slow."})
        self.assertEqual([each["minItems"] for each in (walk["steps"], dog["friends"])], [2, 2])
        self.assertEqual([list(each) for each in walk["steps"]["items"]["anyOf"]],
                         [["minimum", "maximum"], ["maximum", "exclusiveMinimum"]])
        self.assertEqual(list(dog), ["friends"])
        functions = {}
        _, _, body = source.partition("\n\n\n")
        exec("from __future__ import annotations\n" + body, functions)
        self.assertEqual(list(inspect.signature(functions["bag"]).parameters), ["from_"])
        self.assertIn('Steps "a\\b", don\'t count [m]; default 0, 0; >= 0; used with way = slow, fast.',
                      " ".join(functions["walk"].__doc__.split()))

    def test_bad_rows_are_named(self):
        for old, new, message in (("| 1 | slow", "| slow", "line 4: 8 fields, not 9"),
                                  ("| 1 | slow", "| one | slow", "line 4: one is not a number of values"),
                                  ("{ways} none", "{way} none", "line 4: there is no list way above it"),
                                  ("way | word", "way | wort", "line 4: there is no entry of type wort"),
                                  ("group bag", "group other", "line 14: the row is not in its group"),
                                  ("name | name | 1 | required", "name | name | 1 | -", "line 8: the first row of a"),
                                  ("dog | -", "walk | -", "friends of dog is the name of a group walk, which is not"),
                                  ("| Height", "| Height | < three: in mm?", "line 12: < three: in mm. is no usual"),
                                  ("| Height", "| Height | < 3", "line 12: < 3 is no usual range of height"),
                                  ("integer | 2 | required", "real | 2 | 0", "line 6: steps has another type"),
                                  ("| Height", "| Height | - | smaller one", "line 12: height is not mixed: smaller")):
            with self.assertRaisesRegex(TableError, message):
                read_table(GOOD.replace(old, new))


if __name__ == "__main__":
    unittest.main()
