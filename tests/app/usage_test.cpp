// Messages about command lines that are refused.
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>

#include "tests/app/program.h"
#include "tools/build/build_record.h"

namespace mray::test {
namespace {

// Fails with this code and one line on stderr that holds the text; nothing on stdout.
void expect_refused(const std::vector<std::string>& arguments, int code, const std::string& text) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
}

std::vector<std::string> small_render(std::vector<std::string> more) {
    // The folder cannot be made: a test that got as far as writing would fail with 5.
    std::vector<std::string> all = {"render", "builtin:cloth:500", "--backend", "cpu",
                                    "--out",  "/dev/null/out"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

TEST(Usage, NoCommandListsTheCommands) {
    expect_refused(
        {}, 2,
        "choose one of render, view, crosscheck, diff, probe, profile, trace, query, chart, "
        "info, index, devices");
}

TEST(Usage, MissingArgumentIsNamedAsInTheHelp) {
    expect_refused({"crosscheck"}, 2, "morphray: SCENE is required; see `morphray crosscheck --");
    expect_refused({"diff"}, 2, "morphray: FILE FILE is required");
    expect_refused({"trace", "builtin:cloth:500"}, 2, "morphray: --rays is required");
}

TEST(Usage, ViewRefusesWhatHasNoEffect) {
    const auto refused = [](std::vector<std::string> more, const std::string& reason) {
        more.insert(more.begin(), {"view", "builtin:cloth:500"});
        expect_refused(more, 2, reason);
    };
    refused({"--exit"}, "give --screenshot");
    refused({"--screenshot", "image.jpg"}, "a .png file");
    refused({"--compare", "side", "--backend", "cpu"}, "--compare, --backend");
    refused({"--compare", "wipe", "--screenshot", "image.png"}, "--screenshot, --compare");
    refused({"--compare", "slide"}, "did you mean side?");
    refused({"--shading", "prim", "--ground"}, "--ground");
    refused({"--exr", "half"}, "unknown option '--exr'");
}

TEST(Usage, HelpGoesToStdout) {
    const Outcome outcome = run({"--help"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_NE(outcome.out.find("crosscheck"), std::string::npos);
    EXPECT_NE(outcome.out.find("Exit codes: 0 ok, 1 a check failed"), std::string::npos);
}

TEST(Usage, EveryCommandHasHelp) {
    for (const char* command : {"render", "crosscheck", "diff", "probe", "profile", "trace",
                                "query", "chart", "info", "devices"}) {
        const Outcome outcome = run({command, "--help"});
        EXPECT_EQ(outcome.code, 0) << command;
        EXPECT_NE(outcome.out.find(std::string("Usage: morphray ") + command), std::string::npos)
            << outcome.out;
    }
}

TEST(Usage, VersionGoesToStdout) {
    EXPECT_EQ(run({"-v"}).out, run({"--version"}).out);
    const Outcome outcome = run({"--version"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_TRUE(outcome.out.starts_with("morphray ")) << outcome.out;
}

TEST(Usage, VerboseVersionHasTheRecordOfTheBuild) {
    const Outcome outcome = run({"--version", "--verbose"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, run({"--version"}).out + build_record_text() + '\n');
    EXPECT_EQ(run({"--verbose", "-v"}).out, outcome.out);
    for (const std::vector<std::string>& rest :
         {std::vector<std::string>{}, {"info"}, {"info", "--size", "3"}}) {
        std::vector<std::string> arguments = {"--verbose"};
        arguments.insert(arguments.end(), rest.begin(), rest.end());
        expect_refused(arguments, 2,
                       "--verbose: before a command it needs --version; give it after the command");
    }
    expect_refused({"diff", "a", "b", "--verbose"}, 2, "unknown option '--verbose'; ");
}

TEST(Usage, UnknownCommandNamesTheNearest) {
    expect_refused({"rendr", "builtin:cloth"}, 2, "unknown command 'rendr'; did you mean render?");
    expect_refused({"crosschek"}, 2, "did you mean crosscheck?");
}

TEST(Usage, UnknownOptionNamesTheNearest) {
    expect_refused(small_render({"--thread", "3"}), 2,
                   "unknown option '--thread'; did you mean --threads?");
    expect_refused(small_render({"--szie=3x3"}), 2, "did you mean --size?");
}

TEST(Usage, UnknownChoiceNamesTheNearest) {
    expect_refused({"info", "builtin:cloth", "--missing", "hol"}, 2, "did you mean hold?");
    expect_refused(small_render({"--rays", "shadows"}), 2, "did you mean shadow?");
    expect_refused({"render", "builtin:cloth:500", "--backend", "gpu"}, 2, "did you mean vulkan?");
    expect_refused(small_render({"--update", "refi"}), 2, "did you mean refit?");
}

TEST(Usage, OptionOfTheProgramAfterACommandNamesTheRightForm) {
    expect_refused(small_render({"--version"}), 2,
                   "unknown option '--version'; did you mean `morphray --version`?");
}

TEST(Usage, OptionUnlikeAllOthersRefersToTheHelp) {
    expect_refused(small_render({"--verbos"}), 2,
                   "unknown option '--verbos'; did you mean --verbose?");
    expect_refused(small_render({"--=3"}), 2, "see `morphray render --help`");
    expect_refused(small_render({"--wavelength", "3"}), 2, "see `morphray render --help`");
    expect_refused({"--jsn"}, 2, "see `morphray --help`");
}

TEST(Usage, HelpIsACommandToo) {
    EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
    EXPECT_EQ(run({"help", "help"}).out, run({"--help"}).out);
    for (const char* command : {"render", "crosscheck", "diff", "probe", "profile", "trace",
                                "query", "chart", "info", "devices"}) {
        const Outcome outcome = run({"help", command});
        EXPECT_EQ(outcome.code, 0) << command;
        EXPECT_EQ(outcome.err, "");
        EXPECT_EQ(outcome.out, run({command, "--help"}).out);
    }
}

TEST(Usage, HelpOnAnUnknownCommandIsRefused) {
    expect_refused({"help", "rendr"}, 2, "unknown command 'rendr'; did you mean render?");
    expect_refused({"help", "--size"}, 2, "unknown command '--size'; see `morphray --help`");
    expect_refused({"help", "render", "probe"}, 2, "unexpected argument 'probe'");
    expect_refused({"hlep"}, 2, "did you mean help?");
}

// Defaults of options in the help of their commands.
TEST(Usage, HelpShowsTheDefaultsThatDifferBetweenCommands) {
    struct Default {
        const char* command;
        const char* text;
    };
    for (const auto& [command, text] :
         {Default{"render", "size of the image in pixels (1024x1024)"},
          Default{"probe", "size of the image in pixels (1024x1024)"},
          Default{"profile", "size of the image in pixels (1024x1024)"},
          Default{"crosscheck", "size of the image in pixels (256x256)"},
          Default{"render", "between whole frames (all whole frames)"},
          Default{"crosscheck", "(the first, those at a quarter and a half, the last)"},
          Default{"profile", "(the first, those at a quarter and a half, the last)"},
          Default{"trace", "lie between whole frames (the first)"},
          Default{"info", "lie between whole frames (the first)"},
          Default{"render", "(auto: Vulkan where there is a GPU, else the CPU)"},
          Default{"probe", "(auto: Vulkan where there is a GPU, else the CPU)"},
          Default{"profile", "(auto: the CPU, and Vulkan where there is a device)"},
          Default{"crosscheck", "what traces (all)"},
          Default{"trace", "what traces (cpu; with --device or --validate vulkan)"},
          Default{"render", "what each pixel traces (those of --shading lit)"},
          Default{"profile", "what each pixel traces (primary)"},
          Default{"crosscheck", "what each pixel traces (all three"},
          Default{"crosscheck", "--junit FILE|-"}}) {
        // Long lines are broken.
        std::string help;
        for (const char c : run({command, "--help"}).out) {
            if (c != ' ' && c != '\n')
                help += c;
            else if (!help.ends_with(' '))
                help += ' ';
        }
        EXPECT_NE(help.find(text), std::string::npos) << command << ": " << text << '\n' << help;
    }
}

TEST(Usage, RefitOnWithoutARefitIsRefused) {
    for (const char* where : {"cpu", "vulkan"}) {
        expect_refused(small_render({"--update", "rebuild", "--refit-on", where}), 2,
                       "--update rebuild, --refit-on: ");
    }
    expect_refused({"probe", "builtin:cloth:500", "--frame", "0", "--pixel", "0,0", "--update",
                    "rebuild", "--refit-on", "cpu"},
                   2, "--refit-on");
}

TEST(Usage, SeveralFramesAreRefusedWhereOneIsNeeded) {
    for (const char* frames : {"0..4", "0,4", "all"}) {
        for (const char* option : {"--frame", "--frames"}) {
            expect_refused({"probe", "builtin:cloth:500", option, frames, "--pixel", "0,0"}, 2,
                           "several frames; this command takes one");
            expect_refused({"info", "builtin:cloth:500", option, frames}, 2, "several frames");
        }
    }
    expect_refused({"info", "builtin:cloth:500", "--frame", "x"}, 2, "'x' is not a finite number");
    expect_refused({"info", "builtin:cloth:500", "--frame", "99"}, 2, "99 is not in the scene");
}

// One idea has one spelling in all commands; the other number of frames works, too.
TEST(Usage, FrameAndFramesAreOneOption) {
    const std::vector<std::string> probe = {
        "probe", "builtin:cloth:500", "--backend", "cpu", "--size", "16x16", "--pixel", "5,5"};
    const auto with = [](std::vector<std::string> line, const char* option) {
        line.insert(line.end(), {option, "8"});
        return line;
    };
    const Outcome one = run(with(probe, "--frame"));
    EXPECT_EQ(one.code, 0) << one.err;
    EXPECT_EQ(run(with(probe, "--frames")).out, one.out);
    const std::vector<std::string> info = {"info", "builtin:cloth:500"};
    EXPECT_EQ(run(with(info, "--frame")).out, run(with(info, "--frames")).out);
    expect_refused(with(with(probe, "--frame"), "--frames"), 2, "given 2 times");
    TemporaryFolder folder;
    for (const char* option : {"--frame", "--frames"}) {
        const Outcome image = run({"render", "builtin:cloth:500", "--backend", "cpu", "--size",
                                   "8x8", option, "3", "-o", folder.file(option)});
        EXPECT_EQ(image.code, 0) << image.err;
    }
    EXPECT_EQ(read_file(folder.file("--frame") + "/frame_0003.png"),
              read_file(folder.file("--frames") + "/frame_0003.png"));
}

TEST(Usage, MessagesNameTheLongSpelling) {
    expect_refused({"render", "builtin:cloth", "-o", ""}, 2, "--out: the value is empty");
}

TEST(Usage, TwoReportsDoNotShareStdout) {
    for (const char* there : {"-", "/dev/stdout"}) {
        expect_refused({"crosscheck", "builtin:cloth:500", "--json", "-", "--junit", there}, 2,
                       "--json, --junit: both go to stdout");
        expect_refused({"profile", "builtin:cloth:500", "--json", there, "--csv", "-"}, 2,
                       "--json, --csv: both go to stdout");
    }
}

/// Runs in a folder with a mesh a.obj, rays r.txt and a frame d/frame_0000.png; each line is
/// refused, and leaves these files as they were.
TEST(Usage, NoOutputIsAnInputOrAnotherOutput) {
    const TemporaryFolder folder;
    const std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    folder.write("a.obj", mesh);
    folder.write("r.txt", "0 0 1 0 0 -1\n");
    folder.write("d/frame_0000.png", "image");
    std::filesystem::create_symlink("a.obj", folder.path() / "link");
    const std::vector<std::string> before = folder.names();
    for (const char* line :
         {"render a.obj -o o/a.png --json o/a.png", "render a.obj --hits x --json ./x",
          "render a.obj -o o --json o/frame_0000.png", "render a.obj --json out/sheet.png",
          "render a.obj -o o/ --hits h/ --json h/frame_0000.hits",
          "render a.obj -o o/a.png --exr half --json o/a.exr", "render a.obj --json a.obj",
          "render a.obj --json link", "crosscheck a.obj --json x --html x",
          "crosscheck a.obj --json x --bless x", "crosscheck a.obj --json a.obj",
          "crosscheck a.obj --expect x --json x", "profile a.obj --csv x --json x",
          "profile a.obj --baseline r.txt --csv r.txt", "trace a.obj --rays r.txt --out a.obj",
          "trace a.obj --rays r.txt --out r.txt",
          "query a.obj --ask inside --points r.txt --out r.txt", "diff a.obj r.txt --json r.txt"}) {
        std::istringstream words(line);
        const Outcome outcome =
            run({std::istream_iterator<std::string>(words), {}}, {.folder = folder.path()});
        EXPECT_EQ(outcome.code, 2) << line << ": " << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_NE(outcome.err.find(" name"), std::string::npos) << outcome.err;
    }
    EXPECT_EQ(folder.names(), before);
    EXPECT_EQ(read_file(folder.path() / "a.obj"), mesh);
    EXPECT_EQ(read_file(folder.path() / "d/frame_0000.png"), "image");
}

TEST(Usage, DevicesTakeSeveralOutputs) {
    const TemporaryFolder folder;
    EXPECT_EQ(run({"render", "builtin:cloth:300", "--frames", "0", "--size", "8x8", "--backend",
                   "cpu", "--json", "/dev/null", "--hits", "/dev/null", "-o", folder.file("o")})
                  .code,
              0);
}

TEST(Usage, OptionGivenTwiceIsRefused) {
    expect_refused(small_render({"--threads", "2", "--threads", "2"}), 2,
                   "--threads: given 2 times");
    expect_refused(small_render({"-q", "--quiet"}), 2, "given 2 times");
}

TEST(Usage, AMisspeltOptionIsNamedWhereArgumentsAreSeveral) {
    expect_refused({"crosscheck", "builtin:cloth:500", "--framse", "0"}, 2,
                   "unknown option '--framse'; did you mean --frames?");
    expect_refused({"chart", "builtin:cloth:500", "--outt", "charts"}, 2,
                   "unknown option '--outt'; did you mean --out?");
    expect_refused({"diff", "a.hits", "b.hits", "--jsn", "x.json"}, 2,
                   "unknown option '--jsn'; did you mean --json?");
    expect_refused({"render", "builtin:cloth:500", "--threds", "2"}, 2,
                   "unknown option '--threds'; did you mean --threads?");
    // A real mistake in the number of files.
    expect_refused({"diff", "a.hits", "b.hits", "c.hits"}, 2, "unexpected argument 'c.hits'");
    expect_refused({"crosscheck", "builtin:cloth:500", "builtin:cloth:500", "-q", "-q"}, 2,
                   "--quiet: given 2 times");
}

TEST(Usage, ImagesOfOtherKindsAreRefusedAndMakeNoFolder) {
    const TemporaryFolder folder;
    for (const char* name : {"x.jpg", "x.JPEG", "x.PNG", "x.tiff", "x.webp", "x.mp4", "x.exr"}) {
        expect_refused({"render", "builtin:cloth:500", "--frame", "0", "--backend", "cpu", "--size",
                        "8x8", "--out", folder.file(name)},
                       2, ".png file");
    }
    EXPECT_TRUE(folder.names().empty());
    // A folder may have any name.
    std::filesystem::create_directory(folder.path() / "old.jpg");
    for (const char* name : {"new.jpg/", "old.jpg", "take.2"}) {
        const Outcome outcome = run({"render", "builtin:cloth:500", "--frame", "0", "--backend",
                                     "cpu", "--size", "8x8", "--out", folder.file(name)});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_TRUE(std::filesystem::exists(folder.file(name) + "/frame_0000.png")) << name;
    }
}

TEST(Usage, MissingValueIsRefused) {
    expect_refused(small_render({"--threads"}), 2, "--threads");
    expect_refused(small_render({"--eye"}), 2, "--eye");
    expect_refused({"render"}, 2, "SCENE");
    expect_refused({"trace", "builtin:cloth", "--rays", "-"}, 2, "--out");
    expect_refused({"query", "builtin:cloth", "--points", "-"}, 2, "--ask");
    expect_refused({"query", "builtin:cloth", "--ask", "inside"}, 2, "--points");
    expect_refused({"query", "builtin:cloth", "--points", "-", "--ask", "insid"}, 2,
                   "did you mean inside?");
    expect_refused({"query", "builtin:cloth", "--points", "-", "--ask", "inside,inside"}, 2,
                   "--ask: inside is given twice");
}

TEST(Usage, SecondSceneIsRefused) {
    expect_refused(small_render({"builtin:herd"}), 2, "unexpected argument 'builtin:herd'");
}

TEST(Usage, EmptyValueIsRefused) {
    expect_refused({"render", "builtin:cloth", "--out", ""}, 2, "--out: the value is empty");
}

TEST(Usage, ThreadsOutOfRangeAreRefused) {
    for (const char* value : {"0", "-1", "999999", "1025", "nan", "1e3", "2.5", "0x10", "",
                              "99999999999999999999999"}) {
        expect_refused(small_render({"--threads", value}), 2, "--threads");
    }
}

TEST(Usage, UnavailableInstructionSetsAreRefusedByEveryCommand) {
#if defined(__x86_64__)
    const std::string elsewhere = "neon";
#else
    const std::string elsewhere = "avx2";
#endif
    for (const char* command : {"render", "crosscheck", "profile", "probe"}) {
        const std::vector<std::string> line = {command, "builtin:cloth:500", "--backend", "cpu",
                                               "--simd"};
        std::vector<std::string> unknown = line;
        unknown.emplace_back("avx1024");
        expect_refused(unknown, 2, "--simd: SIMD target 'avx1024' is unknown; there are ");
        std::vector<std::string> unavailable = line;
        unavailable.push_back(elsewhere);
        expect_refused(unavailable, 4, "not available on this machine");
    }
}

TEST(Usage, SamplesAndDistancesOutOfRangeAreRefused) {
    for (const char* value : {"257", "2147483648", "-1"}) {
        expect_refused(small_render({"--ao-samples", value}), 2, "--ao-samples");
    }
    expect_refused(small_render({"--rays", "ao", "--ao-samples", "0"}), 2, "--ao-samples 0");
    expect_refused({"profile", "builtin:cloth:500", "--ao-samples", "0"}, 2, "--ao-samples");
    for (const char* value : {"-1", "nan", "inf", "1e999", "far"}) {
        expect_refused(small_render({"--ao-distance", value}), 2, "--ao-distance");
    }
    for (const char* value : {"0", "-3", "1e9"}) {
        expect_refused({"profile", "builtin:cloth:500", "--repeat", value}, 2, "--repeat");
    }
}

TEST(Usage, MalformedSizeIsRefused) {
    for (const char* value : {"0x64", "64x0", "-1x64", "64", "64x", "x64", "64x64x64", "64 x 64",
                              "nanxnan", "1e2x1e2"}) {
        expect_refused(small_render({"--size", value}), 2, "--size");
    }
}

TEST(Usage, SizeBeyondTheLimitIsALimitError) {
    expect_refused(small_render({"--size", "65537x1"}), 6, "65536");
    expect_refused(small_render({"--size", "1000000000x1000000000"}), 6, "65536");
    TemporaryFolder folder;
    expect_refused({"render", "builtin:cloth:500", "--backend", "cpu", "--size", "65536x65536",
                    "--out", folder.file("out")},
                   6, "smaller");
    EXPECT_TRUE(folder.names().empty());
}

TEST(Usage, PointsNeedThreeNumbers) {
    for (const char* value : {"1,2", "1,2,3,4", "1;2;3", "a,b,c", "1,,3", ","}) {
        expect_refused(small_render({"--eye", value}), 2, "--eye");
    }
}

TEST(Usage, PixelsMustLieInTheImage) {
    const auto probe = [](const char* pixel) {
        return std::vector<std::string>{
            "probe", "builtin:cloth:500", "--frame", "0", "--backend", "cpu", "--size",
            "32x16", "--pixel",           pixel};
    };
    for (const char* pixel : {"32,0", "0,16", "70000,0", "-1,0", "1", "1,2,3"}) {
        expect_refused(probe(pixel), 2, "--pixel");
    }
    EXPECT_EQ(run(probe("31,15")).code, 0);
}

TEST(Usage, ImpossibleCamerasAreBadInput) {
    TemporaryFolder folder;
    const std::vector<std::vector<std::string>> cameras = {
        {"--eye", "1,2,3", "--target", "1,2,3"},
        {"--up", "0,0,0"},
        {"--fov", "0"},
        {"--fov", "180"},
        {"--fov", "-5"},
        {"--fov", "nan"},
        {"--fov", "1e99"},
        {"--eye", "nan,0,0"},
        {"--target", "0,inf,0"},
        {"--eye", "1e99,0,0"},
        {"--light", "0,0,-1e300"},
        {"--eye", "0,0,9", "--target", "0,0,0", "--up", "0,0,1"}};
    for (const auto& camera : cameras) {
        std::vector<std::string> arguments = {"render", "builtin:cloth:500", "--backend", "cpu",
                                              "--out",  folder.file("out")};
        arguments.insert(arguments.end(), camera.begin(), camera.end());
        expect_refused(arguments, 3, "");
        EXPECT_TRUE(folder.names().empty());
    }
}

TEST(Usage, NegativeCoordinatesAreValuesNotOptions) {
    TemporaryFolder folder;
    const Outcome outcome =
        run({"render", "builtin:cloth:500", "--backend", "cpu", "--size", "8x8", "--frames", "0",
             "--eye", "-3,-.5,2", "--target", "-.1,0,0", "--out", folder.file("out")});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST(Usage, MalformedFrameRangesAreRefused) {
    TemporaryFolder folder;
    for (const char* frames :
         {"5..2", "0..4:0", "0..4:-1", "a..b", "0..", "nan", "0..inf", "99", "-1", "0..25",
          "0..4:1e-9", "0,", "7,0", "0,0", "0..8:4,8", "0,25", "0,all"}) {
        expect_refused({"render", "builtin:cloth:500", "--backend", "cpu", "--frames", frames,
                        "--out", folder.file("out")},
                       2, "frame");
        EXPECT_TRUE(folder.names().empty()) << frames;
    }
}

TEST(Usage, ListsOfFramesGoWhereverSeveralFramesDo) {
    const std::vector<std::string> scene = {
        "builtin:cloth:500", "--backend", "cpu", "--size", "8x8", "--json", "-",
        "--frames",          "0..4:4,7"};
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"crosscheck", "--rays", "primary", "--simd", "off"},
          {"profile", "--repeat", "1"},
          {"profile", "--repeat", "1", "--policies", "refit,rebuild"}}) {
        std::vector<std::string> line = command;
        line.insert(line.begin() + 1, scene.begin(), scene.end());
        const Outcome outcome = run(line);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        for (const char* frame : {"\"frame\": 0", "\"frame\": 4", "\"frame\": 7"})
            EXPECT_NE(outcome.out.find(frame), std::string::npos) << command[0] << ": " << frame;
        EXPECT_EQ(outcome.out.find("\"frame\": 5"), std::string::npos);
    }
}

TEST(Usage, UnknownBuiltinNamesTheNearest) {
    TemporaryFolder folder;
    expect_refused({"render", "builtin:clot", "--out", folder.file("out")}, 2, "cloth");
    expect_refused({"render", "builtin:cloth:many", "--out", folder.file("out")}, 2, "many");
    EXPECT_TRUE(folder.names().empty());
}

TEST(Usage, BuiltinWithoutNameOrCountListsTheScenes) {
    for (const char* scene : {"builtin:cloth:abc", "builtin:cloth:0", "builtin:cloth:"}) {
        expect_refused({"info", scene}, 2, "such as builtin:cloth:100000");
    }
    expect_refused({"info", "builtin:"}, 2, "the name is missing; ");
    expect_refused({"info", "builtin:"}, 2, "cloth, twist, herd");
}

TEST(Usage, ControlCharactersInArgumentsDoNotReachTheTerminal) {
    const Outcome outcome = run({"info", "no\x1b[31m\nsuch.obj"});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos);
    EXPECT_EQ(lines(outcome.err).size(), 1u);
}

TEST(Usage, TooManySamplesAreRefusedWithAWayOut) {
    expect_refused(small_render({"--size", "16384x16385"}), 6,
                   "give a smaller --size or --samples");
    expect_refused(small_render({"--size", "9000x4", "--samples", "64"}), 6,
                   "9000x4 pixels of 64 samples");
}

TEST(Usage, OptionsOfImagesWithoutEffectAreRefused) {
    expect_refused(small_render({"--rays", "ao", "--shading", "lit"}), 2,
                   "--rays is for --shading plain");
    expect_refused(small_render({"--rays", "ao", "--flat"}), 2, "--flat");
    expect_refused(small_render({"--shading", "depth", "--flat"}), 2, "--flat");
    expect_refused(small_render({"--shading", "normal", "--ground"}), 2, "--ground");
    expect_refused(small_render({"--shading", "depth", "--ao-samples", "3"}), 2, "--ao-samples");
    expect_refused(small_render({"--rays", "shadow", "--ao-samples", "3"}), 2, "--ao-samples");
    expect_refused(small_render({"--rays", "primary", "--ao-distance", "3"}), 2, "--ao-distance");
    expect_refused(small_render({"--rays", "ao", "--ao-samples", "0"}), 2, "--ao-samples 0");
    expect_refused(small_render({"--hits", "a.hits", "--samples", "4"}), 2, "--samples");
    expect_refused(small_render({"--hits", "a.hits", "--ground"}), 2, "--ground");
    expect_refused(small_render({"--rays", "ao", "--exr", "half"}), 2, "--exr");
    expect_refused({"render", "builtin:cloth:500", "--out", "a.exr"}, 2, "--exr");
    expect_refused(small_render({"--samples", "9"}), 2, "'9' is not one of 1, 4, 16, 64");
    expect_refused(small_render({"--shading", "nromal"}), 2, "did you mean normal?");
}

TEST(Usage, OptionsWithoutEffectAreRefusedByEveryCommand) {
    const auto with = [](const char* command, std::vector<std::string> more) {
        std::vector<std::string> line = {command, "builtin:cloth:500"};
        if (line[0] == "probe") line.insert(line.end(), {"--frame", "0", "--pixel", "0,0"});
        line.insert(line.end(), more.begin(), more.end());
        return line;
    };
    for (const char* command : {"crosscheck", "profile", "probe"}) {
        for (const char* option : {"--ao-samples", "--ao-distance"})
            expect_refused(with(command, {"--rays", "shadow", option, "3"}), 2,
                           std::string(option) + ": only --rays ao");
        expect_refused(with(command, {"--rays", "ao", "--light", "1,2,3"}), 2,
                       "--light: only --rays shadow");
    }
    expect_refused(with("profile", {"--ao-samples", "3"}), 2, "--ao-samples: only --rays ao");
    expect_refused(small_render({"--shading", "depth", "--light", "1,2,3"}), 2, "--light: only");
    for (const char* command : {"render", "crosscheck", "profile", "probe", "trace", "query"}) {
        std::vector<std::string> more = {"--backend", "cpu", "--device", "0"};
        if (command == std::string("trace")) more.insert(more.end(), {"--rays", "-", "-o", "-"});
        if (command == std::string("query"))
            more.insert(more.end(), {"--points", "-", "--ask", "inside"});
        expect_refused(with(command, more), 2, "--device: nothing runs on a Vulkan device");
        more[2] = "--validate";
        more.erase(more.begin() + 3);
        expect_refused(with(command, more), 2, "--validate: nothing runs on a Vulkan device");
        more[1] = "vulkan";
        more[2] = "--simd";
        more.insert(more.begin() + 3, "scalar");
        expect_refused(with(command, more), 2, "--simd: nothing is traced on the CPU");
    }
    for (const char* option : {"--max-hits=3", "--crossing=each"})
        expect_refused(with("trace", {"--rays", "-", "-o", "-", option}), 2, "give --all, too");
    expect_refused(with("query", {"--points", "-", "--ask", "winding", "--rule", "odd"}), 2,
                   "--rule: only --ask inside and distance");
    expect_refused(with("query", {"--points", "-", "--ask", "inside", "--max-distance", "1"}), 2,
                   "--max-distance: only --ask distance and closest");
    expect_refused(with("profile", {"--update-budget", "3ms"}), 2, "only the update policy auto");
    expect_refused(with("profile", {"--policies", "refit", "--deterministic-updates"}), 2,
                   "--deterministic-updates: only the update policy auto");
    expect_refused(with("profile", {"--policies", "refit", "--update", "auto"}), 2,
                   "--policies, --update: ");
    expect_refused(with("profile", {"--plot", "a.svg"}), 2, "--plot: shows how policies compare");
    expect_refused(with("probe", {"--update-budget", "3ms"}), 2, "only the update policy auto");
    expect_refused(small_render({"--update", "refit", "--update-budget", "3ms"}), 2,
                   "only the update policy auto");
    expect_refused({"info", "--bvh"}, 2, "--bvh: is about a scene; give one");
    expect_refused({"info", "--frame", "0"}, 2, "--frame: is about a scene");
    expect_refused(with("info", {"--threads", "2"}), 2, "--threads: only --bvh builds trees");
}

}  // namespace
}  // namespace mray::test
