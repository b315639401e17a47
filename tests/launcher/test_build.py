"""Builds and tests of the toy."""

import os
import re
import shutil
import signal
import subprocess
import tempfile
import time

from toy import PROGRAM, Toy


class Build(Toy):
    """What builds the toy."""

    def test_builds_once_and_passes_arguments_on(self):
        arguments = ["run", "my drum.nml", "--set", "time.dt=1e-5", "--threads", "2", "--force"]
        code, output, messages = self.call(*arguments)
        self.assertEqual((code, output), (0, "".join(f"<{word}>\n" for word in arguments)))
        self.assertEqual(messages, "polydem: building program in build/release\n")
        link = os.path.join(self.folder, "another name")
        os.symlink(self.launcher, link)
        self.assertEqual(self.call("--version", launcher=link), (0, "<--version>\n", ""))
        self.assert_fast(0.2, lambda: self.assertEqual(self.call("info"), (0, "<info>\n", "")))

    def test_verify_builds_and_runs_the_benchmarks_alone(self):
        code, output, messages = self.call("verify", "B8")
        self.assertEqual((code, output, messages), (0, "<B8>\n", "polydem: building verify in build/release\n"))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release", "src", "app", "polydem")))

    def test_verify_runs_the_exact_comparison_behind_all_or_by_name(self):
        self.write("tests/verification/CMakeLists.txt", "add_executable(verify verify.f90)\n")
        ends = "   end do\n   if (word == 'B9') stop 1\n   if (word == 'B0') stop 2\n"
        self.write("tests/verification/verify.f90", PROGRAM.replace("   end do\n", ends))
        self.write("tests/geometry/check_exact_overlap.py", "import os, sys\nprint(*sys.argv[1:], sep=' ')\n"
                   "sys.exit(int(os.environ.get('EXACT_CODE', 0)))\n")
        streamed = os.path.join(self.folder, "build/release/tests/geometry/overlap_stream")
        exact = f"{streamed} --full --table results/verify"
        for words, expected in ((("verify",), exact + " --behind\n"),
                                (("verify", "exact"), exact + "\n"),
                                (("verify", "exact", "B8"), f"<B8>\n{exact} --behind\n"),
                                (("verify", "--quick"), "<--quick>\n")):
            self.assertEqual(self.call(*words)[:2], (0, expected))
        self.assertEqual(self.call("verify", "exact", EXACT_CODE="1")[0], 1)
        code, output, _ = self.call("verify", "B9", "exact")
        self.assertEqual((code, output), (1, f"<B9>\n{exact} --behind\n"))
        self.assertEqual(self.call("verify", "B0", "exact")[:2], (2, "<B0>\n"))

    def test_sweep_and_accuracy_know_the_program(self):
        self.write(".venv/bin/python", '#!/bin/bash\nprintf "<%s>\\n" "$@"\n')
        os.chmod(os.path.join(self.folder, ".venv/bin/python"), 0o755)
        program = os.path.join(self.folder, "build/release/src/app/polydem")
        code, output, _ = self.call("sweep", "run", "my sweep", "--cores", "2")
        self.assertEqual((code, os.path.exists(program)), (0, True))
        words = ["-m", "polydem_post", "sweep", "--program", program, "run", "my sweep", "--cores", "2"]
        self.assertEqual(output, "".join(f"<{word}>\n" for word in words))
        code, output, _ = self.call("accuracy", "my scene.nml", "--tolerance", "1e-3")
        words = ["-m", "polydem_post", "accuracy", "--program", program, "my scene.nml", "--tolerance", "1e-3"]
        self.assertEqual((code, output), (0, "".join(f"<{word}>\n" for word in words)))

    def test_benches_and_replays_are_done_by_the_program_of_the_laboratory(self):
        self.write("src/app/CMakeLists.txt", "add_executable(polydem main.f90)\nadd_executable(polydem_lab lab.f90)\n")
        self.write("src/app/lab.f90", PROGRAM.replace("'<'", "'['"))
        for verb in ("bench", "replay"):
            self.assertEqual(self.call(verb, "a b.nml")[:2], (0, f"[{verb}>\n[a b.nml>\n"))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build/release/src/app/polydem")))

    def test_a_changed_source_is_built_and_an_error_shown(self):
        self.call("--version")
        self.write("src/app/main.f90", PROGRAM.replace("'<'", "'['"))
        code, output, messages = self.call("--version")
        self.assertEqual((code, output), (0, "[--version>\n"))
        self.assertIn("building", messages)
        self.write("src/app/main.f90", PROGRAM.replace("integer :: k", ""))
        for _ in range(2):
            code, output, messages = self.call("--version")
            self.assertEqual((code, output), (1, ""))
            self.assertIn("Error: Symbol", messages)

    def test_ninja_is_called_until_it_compiles_nothing(self):
        """Within one call it may leave objects that were compiled with a former module file."""
        real = shutil.which("ninja")
        self.write("calls/ninja", f'#!/bin/sh\necho "$*" >>"$NOTES/ninja"\nexec {real} "$@"\n')
        os.chmod(os.path.join(self.folder, "calls", "ninja"), 0o755)
        path = f"{os.path.join(self.folder, 'calls')}:{self.environment['PATH']}"
        for calls in (2, 3):
            self.assertEqual(self.call("--version", PATH=path)[0], 0)
            self.assertEqual(sum(line.endswith(" src/app/polydem") for line in self.read("ninja")), calls)

    def test_ninja_knows_every_source(self):
        self.write("src/app/CMakeLists.txt", "add_executable(polydem main.f90 ../../elsewhere/idle.f90)\n")
        self.write("elsewhere/idle.f90", "subroutine idle()\nend subroutine idle\n")
        self.assertEqual(self.call("info")[0], 0)
        self.assertEqual(self.call("info"), (0, "<info>\n", ""))
        self.write("elsewhere/idle.f90", "subroutine idle(\nend subroutine idle\n")
        self.assertEqual(self.call("info")[0], 1)
        self.write("elsewhere/idle.f90", "subroutine idle()\nend subroutine idle\n")
        self.assertEqual(self.call("info"), (0, "<info>\n", "polydem: building program in build/release\n"))

    def test_without_ninja_or_compiler_the_built_program_runs(self):
        self.call("info")
        machine = self.bare_machine()
        self.write("src/app/main.f90", PROGRAM.replace("'<'", "'['"))
        for name in ("ninja", "cmake"):
            self.assertEqual(self.call("info", **machine), (0, "<info>\n", ""))
            os.symlink(shutil.which(name), os.path.join(machine["COMMANDS"], name))
        self.assertEqual(self.call("info", **machine), (0, "<info>\n", ""))
        self.assertFalse(os.path.exists(machine["APT_LOG"]))

    def test_the_first_call_keeps_the_working_folder(self):
        self.write("src/app/main.f90", "program here\n   open (10, file='mark')\nend program here\n")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([self.launcher, "info"], env=self.environment, cwd=folder, capture_output=True, check=True)
            self.assertEqual(os.listdir(folder), ["mark"])

    def test_the_preset_chooses_the_folder_and_a_moved_project_is_built_anew(self):
        self.assertEqual(self.call("info", POLYDEM_PRESET="debug")[0], 0)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release")))
        moved = self.folder + " moved"
        shutil.copytree(self.folder, moved, symlinks=True)
        self.addCleanup(shutil.rmtree, moved)
        code, output, messages = self.call("info", launcher=os.path.join(moved, "polydem"), POLYDEM_PRESET="debug")
        self.assertEqual((code, output), (0, "<info>\n"))
        self.assertIn("building", messages)

    def test_info_reads_what_a_run_is_writing(self):
        self.assertEqual(self.call("info")[:2], (0, "<info>\n"))
        program = os.path.join("build", "release", "src", "app", "polydem")
        os.remove(os.path.join(self.folder, program))
        self.write(program, '#!/bin/bash\necho "$1 ${HDF5_USE_FILE_LOCKING:-as usual}"\n')
        os.chmod(os.path.join(self.folder, program), 0o755)
        self.assertEqual(self.call("info"), (0, "info FALSE\n", ""))
        self.assertEqual(self.call("info", HDF5_USE_FILE_LOCKING="TRUE"), (0, "info TRUE\n", ""))
        self.assertEqual(self.call("check"), (0, "check as usual\n", ""))

    def test_an_interrupted_build_did_not_fail(self):
        self.write("src/app/CMakeLists.txt",
                   'add_custom_command(OUTPUT slow.f90 COMMAND "${CMAKE_COMMAND}" -E touch under_way\n'
                   '  COMMAND "${CMAKE_COMMAND}" -E sleep 60)\nadd_executable(polydem main.f90 slow.f90)\n')
        call = subprocess.Popen([self.launcher, "info"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                env=self.environment, start_new_session=True)
        signs = os.path.join(self.folder, "build", "release", "src", "app", "under_way")
        while not os.path.exists(signs) and call.poll() is None:
            time.sleep(0.02)
        os.killpg(call.pid, signal.SIGINT)
        output, messages = call.communicate()
        self.assertEqual((call.returncode, output), (130, ""), messages)
        self.assertEqual(messages.splitlines()[-1], "polydem: interrupted")
        self.assertNotIn("failed", messages)

    def test_scale_needs_only_python(self):
        self.write(".venv/bin/python", '#!/bin/bash\nprintf "<%s>\\n" "$@"\n')
        os.chmod(os.path.join(self.folder, ".venv", "bin", "python"), 0o755)
        code, output, messages = self.call("scale", "my counts.csv", "--body", "1e-6")
        self.assertEqual((code, messages), (0, ""))
        self.assertEqual(output, "<-m>\n<polydem_post>\n<scale>\n<my counts.csv>\n<--body>\n<1e-6>\n")
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release", "src")))

    def write_python(self):
        """A Python that prints its words, and refuses --wrong when it shall only parse them."""
        self.write(".venv/bin/python", '#!/bin/bash\nif [ "$3" = --only-parse ]; then [[ $* != *--wrong* ]] || exit 2\n'
                   'else printf "%s\\n" "$@"; fi\n')
        os.chmod(os.path.join(self.folder, ".venv", "bin", "python"), 0o755)

    def test_wrong_words_of_verbs_that_build_for_minutes_are_refused_before(self):
        self.write_python()
        for verb in ("paper", "workprecision", "rivals"):
            self.assertEqual(self.call(verb, "--wrong"), (2, "", ""))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release", "src")))

    def test_workprecision_builds_three_precisions_and_hands_their_programs_on(self):
        self.write_python()
        code, output, messages = self.call("workprecision", "stack", "--repeats", "2")
        self.assertEqual(code, 0, messages)
        expected = ["-m", "polydem_post", "workprecision"]
        for precision, preset in (("double", "release"), ("single", "single"), ("quadruple", "quadruple")):
            program = os.path.join(self.folder, "build", preset, "src", "app", "polydem")
            self.assertTrue(os.access(program, os.X_OK))
            expected += ["--program", f"{precision}={program}"]
        self.assertEqual(output.splitlines(), [*expected, "stack", "--repeats", "2"])
        self.assertEqual(self.call("workprecision", "--report-only")[1].splitlines(), [*expected[:3], "--report-only"])

    def test_rivals_builds_one_program_and_hands_it_on(self):
        self.write_python()
        program = os.path.join(self.folder, "build", "release", "src", "app", "polydem")
        code, output, messages = self.call("rivals", "slide", "--law", "area")
        self.assertEqual((code, messages), (0, "polydem: building program in build/release\n"))
        expected = ["-m", "polydem_post", "rivals"]
        self.assertEqual(output.splitlines(), [*expected, "--program", f"double={program}", "slide", "--law", "area"])
        self.assertEqual(self.call("rivals", "--report-only")[1].splitlines(), [*expected, "--report-only"])

    def test_build_judges_every_preset(self):
        presets = ("release", "mpi", "single", "quadruple", "debug")
        verdict = re.compile(r"(\w+) +(ok, \d+ s|failed)")

        def judge(*names):
            code, output, messages = self.call("build", *names)
            found = [verdict.fullmatch(line).groups() for line in output.splitlines()]
            return code, [name for name, _ in found], {name for name, word in found if word == "failed"}, messages

        code, names, failed, messages = judge()
        self.assertEqual((code, names, failed), (0, list(presets), set()), messages)
        for name in presets:
            for path in ("src/app/polydem", "tests/verification/verify"):
                self.assertTrue(os.access(os.path.join(self.folder, "build", name, path), os.X_OK))
        self.write("src/app/CMakeLists.txt",
                   "add_executable(polydem main.f90)\ntarget_compile_options(polydem PRIVATE -Wall)\n"
                   "if(PROJECT_BINARY_DIR MATCHES quadruple)\n  target_sources(polydem PRIVATE wrong.f90)\nendif()\n"
                   "if(PROJECT_BINARY_DIR MATCHES single)\n  target_sources(polydem PRIVATE loose.f90)\nendif()\n")
        self.write("src/app/wrong.f90", "subroutine wrong()\n   integer :: k = 'no number'\nend subroutine wrong\n")
        self.write("src/app/loose.f90", "subroutine loose()\n   integer :: idle\nend subroutine loose\n")
        # A program that is there and up to date must not hide its warnings.
        self.assertEqual(self.call("--version", POLYDEM_PRESET="single")[0], 0)
        for _ in range(2):
            code, names, failed, messages = judge()
            self.assertEqual((code, names, failed), (1, list(presets), {"single", "quadruple"}), messages)
            self.assertIn("Warning: Unused variable", messages)
            self.assertIn("Error: ", messages)
        self.write("src/app/loose.f90", "subroutine loose()\nend subroutine loose\n")
        self.assertEqual(judge("single", "mpi")[:3], (0, ["single", "mpi"], set()))
        self.assertEqual(judge("single", "quadruple")[:3], (1, ["single", "quadruple"], {"quadruple"}))
        code, output, messages = self.call("build", "single", "triple")
        self.assertEqual((code, output), (2, ""))
        self.assertIn("there is no preset triple; choose from release", messages)

    def test_simultaneous_first_calls_build_once(self):
        calls = [subprocess.Popen([self.launcher, "info"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  env=self.environment) for _ in range(3)]
        results = [call.communicate() for call in calls]
        self.assertEqual([output for output, _ in results], 3*["<info>\n"])
        self.assertEqual("".join(messages for _, messages in results).count("building"), 1)
        calls = [subprocess.Popen([self.launcher, "info"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  env=self.environment) for _ in range(6)]
        self.assertEqual([call.communicate() for call in calls], 6*[("<info>\n", "")])

    def test_tests_are_chosen_by_label_and_counted_in_the_last_line(self):
        code, output, _ = self.call("test")
        self.assertNotEqual(code, 0)
        self.assertEqual(output.splitlines()[-1], "3 passed, 1 failed, 1 skipped")
        self.assertTrue(os.path.exists(os.path.join(self.folder, "build", "mpi", "src", "app", "polydem")))
        code, output, _ = self.call("test", "c.d")
        self.assertEqual((code, output.splitlines()[-1]), (0, "1 passed, 0 failed, 1 skipped"))
        code, output, _ = self.call("test", "broken")
        self.assertNotEqual(code, 0)
        self.assertEqual(output.splitlines()[-1], "0 passed, 1 failed")
        for label in ("fin", "c-d", "unheard_of"):
            code, output, _ = self.call("test", label)
            self.assertEqual((code != 0, output.splitlines()[-1]), (True, "0 passed, 0 failed"))

    def test_only_tests_install_what_tests_need(self):
        self.write(".venv/bin/python", '#!/bin/bash\necho "$*" >>"$NOTES/asked"\n')
        os.chmod(os.path.join(self.folder, ".venv", "bin", "python"), 0o755)
        asked = f"-m pip install --quiet --disable-pip-version-check --editable {self.folder}/postproc"
        machine = os.path.join(self.folder, "machine")
        self.write("machine/python3", f'#!/bin/bash\nif [ "$2" = venv ]; then rm -f "{self.folder}/.venv/".made*; fi\n')
        os.chmod(os.path.join(machine, "python3"), 0o755)
        find = "find_python() { echo " + f"'{machine}/python3'" + "; }"
        text = "\n".join(self.read("polydem")).replace('main "$@"', find + '\nmain "$@"')
        self.write("polydem", text + "\n")
        for name in (".made", ".made_manual", ".made_test"):
            os.remove(os.path.join(self.folder, ".venv", name))
        self.assertEqual(self.call("plot", "result.h5")[0], 0)
        self.assertEqual(self.read("asked"), [asked, "-m polydem_post plot result.h5"])
        os.remove(os.path.join(self.folder, "asked"))
        self.assertEqual(self.call("export", "result", "--to=gsd")[0], 0)
        self.assertEqual(self.read("asked"), [asked + "[gsd]", "-m polydem_post export result --to=gsd"])
        os.remove(os.path.join(self.folder, "asked"))
        self.assertEqual(self.call("test", "fine")[0], 0)
        self.assertEqual(self.read("asked"), [asked + "[test]", asked + "[manual]"])
        os.remove(os.path.join(self.folder, "asked"))
        self.assertEqual(self.call("test", "fine")[0], 0)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "asked")))
        # What was added is kept when the requirements change, and when the folder has moved.
        self.environment["POLYDEM_EXTRAS"] = "pictures,readers"
        self.assertEqual(self.call("plot", "result.h5")[0], 0)
        del self.environment["POLYDEM_EXTRAS"]
        os.utime(os.path.join(self.folder, "postproc", "pyproject.toml"), (time.time() + 5,)*2)
        self.assertEqual(self.call("plot", "result.h5")[0], 0)
        os.utime(os.path.join(self.folder, "postproc", "pyproject.toml"), (0, 0))
        self.write(".venv/.made", "/elsewhere\n")
        self.assertEqual(self.call("plot", "result.h5")[0], 0)
        self.assertEqual(self.call("plot", "result.h5")[0], 0)
        plot, kept = "-m polydem_post plot result.h5", "[gsd,manual,pictures,readers,test]"
        self.assertEqual(self.read("asked"), [asked + "[pictures,readers]", plot, asked + kept, plot, asked + kept,
                                              plot, plot])
