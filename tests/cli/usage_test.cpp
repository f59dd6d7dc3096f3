// Wrong command lines: exit code 2, one clear line, and nothing written.
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/cli/program.h"

namespace pileus {
namespace {

struct Usage : testing::Test, ProgramTest {
  Usage() { write("scene.toml", kSmallScene); }

  /// The complaint of `pileus render scene.toml -o picture.exr ARGUMENTS`, which must end with exit code 2.
  std::string refusal(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"render", "scene.toml", "-o", "picture.exr"});
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(folder.file_count(), 1u) << "something was written";
    return outcome.err;
  }
};

TEST_F(Usage, help_and_version_are_no_errors) {
  for (const char* option : {"--help", "-h"}) {
    const ProgramOutcome outcome = run({option});
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_NE(outcome.out.find("Examples:"), std::string::npos);
  }
  for (const char* command : {"render", "cloud", "info", "explain", "accuracy", "diff", "plugins"}) {
    const ProgramOutcome outcome = run({command, "--help"});
    EXPECT_EQ(outcome.exit_code, 0) << command;
    EXPECT_NE(outcome.out.find("Examples:"), std::string::npos) << command;
  }
  EXPECT_EQ(run({"--version"}).out.find("pileus "), 0u);
}

TEST_F(Usage, a_command_and_its_input_are_needed) {
  const ProgramOutcome none = run({});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_EQ(none.err.find("A subcommand is required\n"), 0u) << none.err;
  for (const char* command : {"render", "explain", "cloud", "info", "accuracy", "diff"}) {
    EXPECT_EQ(run({command}).exit_code, 2) << command;
  }
}

TEST_F(Usage, mistyped_options_come_with_the_nearest) {
  const std::string help = "Run pileus render --help for more information.\n";
  for (const std::vector<std::string>& mistake : {std::vector<std::string>{"--tolerence", "1"},
                                                  {"--tolerence=1"},
                                                  {"--quiet", "--tolerence", "1", "-x"}})
    EXPECT_EQ(refusal(mistake),
              "pileus render: error: unknown option --tolerence; nearest: --tolerance\n" + help);
  EXPECT_EQ(refusal({"--memry", "4G"}),
            "pileus render: error: unknown option --memry; nearest: --memory\n" + help)
      << "an option of all commands";
  EXPECT_EQ(refusal({"--bogus"}), "pileus render: error: unknown option --bogus\n" + help);
  EXPECT_EQ(refusal({"b.png"}),
            "pileus render: error: one argument too many: \"b.png\"; outputs are named with -o\n" + help);
}

TEST_F(Usage, mistyped_commands_come_with_the_nearest) {
  const auto told = [&](const std::vector<std::string>& arguments) {
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err.substr(0, outcome.err.find('\n'));
  };
  const std::string expected = "; expected render, cloud, convert, info, explain, accuracy, diff or plugins";
  EXPECT_EQ(told({"rendr", "scene.toml"}),
            "pileus: error: unknown command \"rendr\"" + expected + "; nearest: render");
  EXPECT_EQ(told({"scene.toml"}), "pileus: error: unknown command \"scene.toml\"" + expected);
  EXPECT_EQ(told({"--memry", "4G", "rendr"}), "pileus: error: unknown option --memry; nearest: --memory");
}

TEST_F(Usage, the_extension_of_the_input_says_what_it_is) {
  const ProgramOutcome outcome = run({"render", write("scene.json", "{}"), "-o", "a.png"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err,
            "scene.json: error: extension \".json\" is neither a scene (.toml) nor a volume "
            "(.vdb, .nvdb, .df3, .npy or .raw)\n");
}

TEST_F(Usage, files_that_are_missing_fail_with_1) {
  for (const char* command : {"render", "explain"}) {
    const ProgramOutcome outcome = run({command, "missing.toml"});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.err, "missing.toml: error: cannot be read: No such file or directory\n");
  }
  for (const char* command : {"render", "explain", "info"}) {
    const ProgramOutcome outcome = run({command, "missing.vdb"});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.err, "missing.vdb: error: no such file\n");
  }
  std::filesystem::create_directory(folder / "folder.toml");
  EXPECT_EQ(run({"render", "folder.toml"}).err, "folder.toml: error: cannot be read: Is a directory\n");
}

TEST_F(Usage, half_floats_need_a_file_that_has_them) {
  const ProgramOutcome outcome = run({"render", "scene.toml", "-o", "a.png", "--half"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "pileus: error: --half is about .exr files; none is to be written\n");
}

TEST_F(Usage, a_recipe_is_no_volume) {
  for (const char* volume : {"smoke.vdb", "smoke.nvdb"}) {
    const ProgramOutcome outcome = run({"cloud", write(volume, "\x20\x42\x44\x56\xff"), "-o", "a.vdb"});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.err,
              std::string(volume) +
                  ": error: is a volume already; expected a scene (.toml) with the "
                  "recipe of one. `pileus convert` changes volumes, `pileus render` shows them\n");
  }
}

TEST_F(Usage, sizes_must_be_two_numbers_that_fit) {
  for (const char* size : {"16", "16x", "x9", "16x9x3", "16,9", "a", "1.5x2", "99999999999x9",
                           "16x4294967305", "0x0", "0x9", "16x-9", "65537x1"}) {
    EXPECT_EQ(refusal({std::string("--size=") + size}),
              std::string("pileus: error: --size ") + size +
                  "; expected WIDTHxHEIGHT from 1x1 to 65536x65536, such as 960x540\n");
  }
}

TEST_F(Usage, a_picture_that_no_memory_holds_is_refused) {
  if (double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE)) > 171e9) GTEST_SKIP() << "it fits here";
  const ProgramOutcome outcome = run({"render", "scene.toml", "-o", "a.exr", "--size", "65536x65536"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err.find(
                "pileus: error: a picture of 65536 x 65536 pixels needs up to 171.8 GB; this machine has "),
            0u)
      << outcome.err;
}

TEST_F(Usage, crops_must_lie_in_the_picture) {
  for (const char* crop : {"1,2,3", "1,2,3,4,5", "a,b,c,d", "0,0,4294967300,4", "1 2 3 4"}) {
    EXPECT_EQ(refusal({"--crop", crop}),
              std::string("pileus: error: --crop ") + crop + "; expected X0,Y0,X1,Y1 in pixels\n");
  }
  for (const char* crop : {"0,0,25,16", "0,0,24,17", "4,4,4,8", "8,4,4,8"}) {
    EXPECT_EQ(refusal({"--crop", crop}), std::string("pileus: error: crop ") + crop +
                                             " is empty or not inside the picture of 24 x 16 pixels\n");
  }
  EXPECT_EQ(refusal({"--crop=-1,0,4,4"}),
            "pileus: error: crop -1,0,4,4 is empty or not inside the picture of 24 x 16 pixels\n");
}

TEST_F(Usage, overrides_are_checked_like_the_scene_and_named_as_given) {
  EXPECT_EQ(refusal({"--set", "foo"}), "--set foo: error: expected path.to.key=value\n");
  EXPECT_EQ(refusal({"--set", "=1"}), "--set =1: error: expected path.to.key=value\n");
  EXPECT_EQ(refusal({"--set", "render.=1"}), "--set render.=1: error: expected path.to.key=value\n");
  EXPECT_EQ(refusal({"--set", "render..size=1"}),
            "--set render..size=1: error: expected path.to.key=value\n");
  EXPECT_EQ(refusal({"--set", "render.size.x=1"}),
            "--set render.size.x=1: error: \"size\" is an array of 2, not a table\n");
  EXPECT_EQ(refusal({"--set", "render.tolerance=low"}),
            "--set render.tolerance=low: error: render: tolerance = \"low\"; expected a number (>= 0)\n");
  EXPECT_EQ(
      refusal({"--set", "render.tolerence=1"}),
      "--set render.tolerence=1: error: render: unknown parameter \"tolerence\"; expected integrator, size, "
      "tolerance, pixel_samples, max_bounces, seed or aovs; nearest: tolerance\n");
  EXPECT_EQ(refusal({"--set", "render.tolerance=1\n[x]\ny=2"}),
            "--set render.tolerance=1 [x] y=2: error: expected a single value\n");
}

TEST_F(Usage, numbers_out_of_range_are_refused) {
  EXPECT_EQ(refusal({"--tolerance", "nan"}),
            "--set render.tolerance=nan: error: render: tolerance = nan is not a finite number\n");
  EXPECT_EQ(refusal({"--tolerance=-1"}),
            "--set render.tolerance=-1: error: render: tolerance = -1 is out of range; expected >= 0\n");
  EXPECT_EQ(refusal({"--seed", "99999999999"}),
            "--set render.seed=99999999999: error: render: seed = 99999999999; expected an integer (>= 0)\n");
  EXPECT_EQ(refusal({"--threads=-1"}).find("--threads: Value -1 not in range 0 to 1024\n"), 0u);
  for (const char* seconds : {"0", "-1", "nan", "inf", "soon"}) {
    EXPECT_EQ(refusal({std::string("--time-limit=") + seconds})
                  .find(std::string("--time-limit: ") + seconds + " is no positive number\n"),
              0u);
  }
}

TEST_F(Usage, a_time_limit_leaves_no_checkpoint_to_resume) {
  EXPECT_NE(refusal({"--resume", "--time-limit", "1"}).find("excludes"), std::string::npos);
}

TEST_F(Usage, unknown_names_come_with_the_nearest) {
  EXPECT_EQ(refusal({"--integrator", "exct"}),
            "--set render.integrator=\"exct\": error: render: unknown integrator type \"exct\"; expected "
            "exact, march "
            "or uniform; nearest: exact\n");
  EXPECT_EQ(refusal({"--aov", "beauty,transmitance"}),
            "pileus: error: unknown AOV \"transmitance\"; expected beauty, transmittance, Z, samples, "
            "error_estimate or error_bound; nearest: transmittance\n");
  EXPECT_EQ(refusal({"--set", "render.aovs="}),
            "pileus: error: no AOV to write; expected some of beauty, transmittance, Z, samples, "
            "error_estimate or error_bound\n");
}

TEST_F(Usage, outputs_are_refused_before_the_render) {
  const auto complaint = [&](const std::string& output, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"render", "scene.toml", "-o",          output,
                                       "--size", "4000x4000",  "--tolerance", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramOutcome outcome = run(arguments);
    EXPECT_LT(outcome.seconds, 5.0);
    EXPECT_GT(outcome.exit_code, 0);
    EXPECT_EQ(folder.file_count(), 1u);
    return outcome.err;
  };
  EXPECT_EQ(complaint("a.jpg"), "a.jpg: error: the name ends in \".jpg\"; expected .exr or .png\n");
  EXPECT_EQ(complaint("nowhere/a.png"),
            "nowhere/a.png: error: no file can be created in nowhere (No such file or directory); expected a "
            "writable folder\n");
  EXPECT_EQ(
      complaint("a.png", {"--report", "nowhere/a.json"}),
      "nowhere/a.json: error: no file can be created in nowhere (No such file or directory); expected a "
      "writable folder\n");
  EXPECT_EQ(complaint("a.png", {"--aov", "Z"}),
            "a.png: error: shows the AOV beauty, which --aov leaves out; expected an .exr file\n");
}

}  // namespace
}  // namespace pileus
