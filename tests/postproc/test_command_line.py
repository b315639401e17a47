"""The command line: pictures, tables, help, errors."""

import argparse
import os
import re
import signal
import subprocess
import sys

import pytest
from matplotlib.image import imread
from polydem_post.command_line.main import _parser, help_files, help_text, main


def test_draws_the_last_frame_into_the_result(finished, capsys):
    assert main(["plot", str(finished)]) == 0
    path = finished / "frame_0006.png"
    assert capsys.readouterr().out.strip() == str(path)
    pixels = imread(path)
    assert min(pixels.shape[:2]) > 200
    assert pixels[..., :3].std() > 0.02
    path.unlink()


@pytest.mark.parametrize("colour", ["speed", "angle", "id", "none"])
def test_draws_frames_side_by_side(finished, tmp_path, colour):
    three = tmp_path / "three.png"
    command = ["plot", str(finished), "--frames", "0,3,-1", "--contacts", "--colour", colour, "--output", str(three)]
    assert main([*command, "--columns", "3"]) == 0
    side_by_side = imread(three).shape
    assert main([*command, "--columns", "1"]) == 0
    assert side_by_side[1] > 1.3 * imread(three).shape[1]
    assert imread(three).shape[0] > 1.3 * side_by_side[0]


def test_pictures_are_reproducible(finished, tmp_path):
    paths = [tmp_path / name for name in ("first.png", "second.png")]
    for path in paths:
        assert main(["plot", str(finished), "--output", str(path)]) == 0
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    "form, line",
    [
        ("text", "boxes           4   125000.00  250000.00  500000.00      1.000       50.0"),
        ("markdown", "| boxes | 4 | 125000.00 | 250000.00 | 500000.00 | 1.000 | 50.0 |"),
        ("latex", r"boxes & 4 & 125000.00 & 250000.00 & 500000.00 & 1.000 & 50.0 \\"),
        ("csv", "boxes,4,125000.00,250000.00,500000.00,1.000,50.0"),
    ],
)
def test_prints_the_table_of_times(finished, capsys, form, line):
    assert main(["table", str(finished), "--format", form]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert line in lines
    assert not any("overlap" in text for text in lines)


def test_an_interrupted_verb_ends_with_a_sentence(monkeypatch, capsys):
    def press(options):
        raise KeyboardInterrupt

    monkeypatch.setattr("polydem_post.command_line.data_verbs._table", press)
    assert main(["table", "result"]) == 130
    assert capsys.readouterr().err == "table: interrupted\n"


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["plot", "no/such/folder"], "no/such/folder: there is no such file or folder"),
        (["table", "no/such/folder"], "no/such/folder: there is no such file or folder"),
        (["plot", "RESULT", "--frame", "7"], "there is no frame 7, only 7 frames"),
        (["plot", "RESULT", "--output", "no/such/folder/x.png"], "x.png: cannot be written (there is no folder no/"),
        (["plot", "RESULT", "--output", "x.unknown"], "x.unknown: cannot be written: the name must end with .pdf"),
        (["plot", "RESULT", "--output", "x.gif"], "./polydem movie makes films"),
        (["plot", "RESULT", "--frames", "1,b"], "'b' is neither the number of a frame nor a range FIRST:END:STEP"),
        (["plot", "RESULT", "--frames", "9:12"], "9:12 contains none of the 7 frames"),
        (["plot", "RESULT", "--times", "99"], "no frame near 99 s; the frames are from 0.5 to 3.5 s"),
        (["plot", "RESULT", "--colour", "sped"], "there is no colour sped; there are speed, velocity_x"),
        (["plot", "RESULT", "--map", "viridian"], "there is no colour map viridian"),
        (["plot", "RESULT", "--show", "forces,walls"], "walls cannot be shown; there are contacts, forces"),
        (["plot", "RESULT", "--range", "2,1"], "--range: 2 is not below 1"),
        (["plot", "RESULT", "--limits", "0,1,2"], "--limits takes 4 numbers, as in X0,X1,Y0,Y1"),
        (["plot", "RESULT", "--limits", "50,60,0,1"], "no body is within the limits 50,60,0,1; the bodies are at x "),
        (["plot", "RESULT", "--size", "5,100"], "--size takes a width and a height from 30"),
        (["plot", "RESULT", "--dpi", "0"], "--dpi takes a number from 10 to 2400"),
    ],
)
def test_explains_errors_and_ends_with_code_2(finished, capsys, arguments, message):
    assert main([str(finished) if word == "RESULT" else word for word in arguments]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("arguments, message", [
    (["plot", "x", "--colr", "speed"], "plot: error: there is no option --colr; did you mean --color?"),
    (["plot", "x", "--wall=1"], "plot: error: there is no option --wall; see polydem_post plot --help"),
    (["costs", "--program", "x", "--wrong"], "costs: error: there is no option --wrong; see polydem_post costs --help"),
    (["plot", "x", "y"], "plot: error: there is no place for the argument 'y'"),
    (["sweep", "run", "x", "--retyr"], "sweep run: error: there is no option --retyr; did you mean --retry?"),
    (["--only-parse", "paper", "--quik"], "paper: error: there is no option --quik; did you mean --quick?"),
])
def test_a_word_that_a_verb_does_not_know_is_named_with_its_verb(monkeypatch, capsys, arguments, message):
    monkeypatch.delenv("POLYDEM_CALL", raising=False)
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    said = capsys.readouterr().err.splitlines()
    assert message in said[-1]
    assert said[0].startswith(f"usage: polydem_post {arguments[-2] if arguments[0][0] == '-' else arguments[0]}")


def test_words_can_be_parsed_without_doing_anything(capsys):
    assert main(["--only-parse", "paper", "--dry-run", "--output", "no/such/folder"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("arguments", [[], ["paint", "x"], ["plot"], ["plot", "x", "--times", "1,b"]])
def test_a_wrong_command_line_ends_with_code_2(arguments):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2


def parsers():
    """All parsers by their words, without the program's name."""
    found, open_ones = {}, [_parser(["tables"])]
    while open_ones:
        parser = open_ones.pop()
        found[tuple(parser.prog.split()[1:])] = parser
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                open_ones += action.choices.values()
    del found[()]
    return found


def part_of(words):
    """The part of a help text that speaks of a verb, or of one step of a verb."""
    text = help_text(words[0])
    return text[text.index("\n" + " ".join(words)):].split("\n\n")[0] if len(words) > 1 else text


@pytest.mark.parametrize("words", parsers(), ids=" ".join)
def test_the_help_text_names_every_option_and_its_default(words):
    part = part_of(words)
    for action in parsers()[words]._actions:
        for name in action.option_strings:
            assert re.search(rf"(^|, | ){name}( |,|$)", part, re.MULTILINE) or name in ("-h", "--help")
        said = re.search(rf"  {action.option_strings[-1]} .*(?:\n {{20}}.*)*?\(default: ([^,;)]\S*?)[;)]", part) \
            if action.option_strings and action.default not in (None, False, [], argparse.SUPPRESS) else None
        if said:
            assert (action.type or str)(said[1]) == action.default, said[0]
        elif action.option_strings:
            assert action.default in (None, False, [], argparse.SUPPRESS), f"no default of {action.option_strings}"


def test_the_help_texts_name_no_other_options():
    known = {}
    for words, parser in parsers().items():
        known.setdefault(words[0], set()).update(name for action in parser._actions for name in action.option_strings)
    assert set(help_files()) == set(known)
    for verb, options in known.items():
        assert set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", help_text(verb))) <= options, verb


def test_the_usage_line_says_how_the_tool_was_called(capsys, monkeypatch):
    monkeypatch.setenv("POLYDEM_CALL", "./polydem")
    with pytest.raises(SystemExit):
        main(["plot"])
    assert capsys.readouterr().err.startswith("usage: ./polydem plot RESULT [OPTIONS]\n./polydem plot: error: ")


def test_help_is_the_text_of_the_verb(capsys, monkeypatch):
    monkeypatch.delenv("POLYDEM_CALL", raising=False)
    for words in parsers():
        with pytest.raises(SystemExit) as end:
            main([*words, "--help"])
        assert (end.value.code, capsys.readouterr().out) == (0, f"usage: polydem_post {help_text(words[0])}")
    with pytest.raises(SystemExit):
        main(["--help"])
    output = capsys.readouterr().out
    assert all(f"\n  {words[0]} " in output for words in parsers())
    with pytest.raises(SystemExit):
        main(["plot"])
    assert capsys.readouterr().err.startswith("usage: polydem_post plot RESULT [OPTIONS]\n")


@pytest.mark.parametrize("verb, name", [("plot", "a.png"), ("plot", "a.pdf"), ("plot", "a.svg"), ("movie", "a.gif"),
                                        ("movie", "a.mp4"), ("view", "a.html")])
def test_only_own_pictures_are_replaced(finished, tmp_path, capsys, verb, name):
    path = tmp_path / name
    if name.endswith(".mp4"):
        pytest.importorskip("imageio_ffmpeg")
    path.write_text("a file of others")
    assert main([verb, str(finished), "-o", str(path)]) == 2
    assert f"{path}: exists, and this version of polydem did not make it" in capsys.readouterr().err
    assert path.read_text() == "a file of others"
    path.unlink()
    assert main([verb, str(finished), "-o", str(path)]) == 0
    first = path.read_bytes()
    assert main([verb, str(finished), "-o", str(path)]) == 0
    assert path.read_bytes() == first
    assert [each.name for each in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("module", ["numpy", "matplotlib"])
def test_an_interrupt_while_modules_load_ends_a_verb_without_a_traceback(tmp_path, finished, module):
    """The module that a verb loads next is one that stands for a user who presses Ctrl-C meanwhile."""
    (tmp_path / f"{module}.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nimport time\n"
                                           "time.sleep(600)\n", encoding="utf-8")
    paths = os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]])
    done = subprocess.run([sys.executable, "-m", "polydem_post", "plot", str(finished)], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": paths}, check=False)
    assert (done.returncode, done.stderr) in [(-signal.SIGINT, ""), (130, "plot: interrupted\n")]
    assert done.stdout == ""
