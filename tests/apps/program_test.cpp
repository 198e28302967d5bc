// The program as a person meets it: what it prints and what it tells the shell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "apps/program_path.h"

namespace kerf::app::program_test {
namespace {

using ::testing::HasSubstr;

struct Outcome {
  int status = -1;
  std::string text;  ///< stdout and stderr
};

Outcome kerf(const std::string& arguments, const std::string& environment = "") {
  Outcome out;
  std::FILE* pipe = popen((environment + " " + test::program_path() + " " + arguments + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return out;
  char buffer[4096];
  for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.text.append(buffer, n);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) out.status = WEXITSTATUS(status);
  return out;
}

class ProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("kerf_program_test_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string in(const std::string& name) const { return (folder_ / name).string(); }
  std::filesystem::path folder_;
};

TEST_F(ProgramTest, HelpTeaches) {
  EXPECT_EQ(kerf("--help").status, 0);
  EXPECT_EQ(kerf("--version").text.rfind("kerf ", 0), 0u);
  for (const char* command : {"run", "bind", "make", "info", "cut"}) {
    const Outcome help = kerf(std::string(command) + " --help");
    EXPECT_EQ(help.status, 0) << command;
    EXPECT_THAT(help.text, HasSubstr("Examples:")) << command;
  }
}

TEST_F(ProgramTest, TablesOfBenchmarksHaveLines) {
  const Outcome out = kerf("bench scale --quick --rows threads");
  EXPECT_EQ(out.status, 0) << out.text;
  EXPECT_NE(out.text.find("\n| threads |"), std::string::npos) << out.text;
}

TEST_F(ProgramTest, BadInputIsStatusTwo) {
  EXPECT_EQ(kerf("").status, 2);
  EXPECT_EQ(kerf("rnu steak").status, 2);
  EXPECT_EQ(kerf("run steak").status, 2);  // no --out
  EXPECT_EQ(kerf("cut steak --from 0,0 --to 1,0,0 --out " + in("x")).status, 2);
  EXPECT_EQ(kerf("cut steak --from 0,0,nan --to 1,0,0 --out " + in("x")).status, 2);
  EXPECT_EQ(kerf("info " + in("none.obj")).status, 2);
  EXPECT_EQ(kerf("make stek --out " + in("x")).status, 2);
  const Outcome typo = kerf("run steek --out " + in("x"));
  EXPECT_EQ(typo.status, 2);
  EXPECT_THAT(typo.text, HasSubstr("did you mean \"steak\"?"));
  std::ofstream(in("bad.toml")) << "[body]\nmodel = \"steak\"\n[material]\nyuong = 1\n";
  const Outcome bad = kerf("run " + in("bad.toml") + " --out " + in("x"));
  EXPECT_EQ(bad.status, 2);
  EXPECT_THAT(bad.text, HasSubstr("bad.toml:4: unknown key \"yuong\" in [material]; did you mean \"young\"?"));
}

TEST_F(ProgramTest, NamesTheCommandThatIsNone) {
  const std::vector<std::pair<std::string, std::string>> said{
      {"rnu steak", "kerf: there is no command \"rnu\"; did you mean \"run\"?\n"},
      {"nonsense",
       "kerf: there is no command \"nonsense\"; there are run, bind, make, info, cut, view, replay, bench\n"},
      {"bench papr", "kerf: there is no command \"bench papr\"; did you mean \"bench paper\"?\n"}};
  for (const auto& [words, why] : said) {
    const Outcome out = kerf(words);
    EXPECT_EQ(out.status, 2) << words;
    EXPECT_THAT(out.text, HasSubstr(why));
  }
}

TEST_F(ProgramTest, FoldersOfMeshesAreThere) {
  for (const std::string& command : {"run steak -o " + in("x"), std::string("view steak"), std::string("replay x")}) {
    const Outcome out = kerf(command + " --meshes " + in("none"));
    EXPECT_EQ(out.status, 2) << command;
    EXPECT_THAT(out.text, HasSubstr("Directory does not exist: " + in("none"))) << command;
  }
}

TEST_F(ProgramTest, OneOfAKindIsSingular) {
  std::ofstream(in("one.toml")) << "[body]\nmodel = \"sheet\"\n[simulation]\nduration = 0.01\n[output]\nmeshes = []\n"
                                   "animation = false\npicture = false\n";
  EXPECT_THAT(kerf("run " + in("one.toml") + " -o " + in("x")).text, HasSubstr("  1 piece; visual"));
}

// Whoever names a file could else write lines of the program's, or turn what stands after the name.
TEST_F(ProgramTest, NamesStayOnOneLine) {
  const std::string name = in("new\nkerf: line\u202e\u2028");
  const std::string quoted = "'" + name + "'", folder = "'" + name + "x'";
  for (const std::string& command :
       {"info " + quoted + ".obj", "bind " + quoted + ".obj -o " + in("x.kerf"), "run " + quoted + " -o " + in("x"),
        "cut " + quoted + ".kerf --from 0,0,0 --to 1,0,0 -o " + in("x"), "replay " + quoted,
        "make " + quoted + " -o " + in("x"), "bind steak -o " + quoted + "/", "rnu " + quoted}) {
    const Outcome out = kerf(command);
    EXPECT_EQ(out.status, 2) << command;
    EXPECT_THAT(out.text, HasSubstr("kerf: ")) << command;
    EXPECT_THAT(out.text, ::testing::Not(HasSubstr("\nkerf: "))) << command;
    for (const char* hidden : {"\u202e", "\u2028"}) EXPECT_THAT(out.text, ::testing::Not(HasSubstr(hidden))) << command;
  }
  std::ofstream(name + ".obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n";
  EXPECT_THAT(kerf("info " + quoted + ".obj").text, HasSubstr("new\\x0akerf: line\\u202e\\u2028.obj:5: a face"));
  std::ofstream(name + ".toml") << "[body]\nmodel = \"steak\"\nmdel = \"\\n\"\n\"a\\nb\" = 1\n";
  const Outcome scene = kerf("run " + quoted + ".toml -o " + in("x"));
  EXPECT_THAT(scene.text, HasSubstr("line\\u202e\\u2028.toml:3: unknown key \"mdel\""));
  EXPECT_THAT(scene.text, HasSubstr("line\\u202e\\u2028.toml:4: unknown key \"a\\x0ab\""));
  const Outcome made = kerf("make sheet -o " + folder);
  EXPECT_EQ(made.status, 0);
  EXPECT_THAT(made.text, HasSubstr("written to " + in("new\\x0akerf: line")));
}

TEST_F(ProgramTest, MessagesHaveABound) {
  const std::string key(1000000, 'k'), name(100000, 'n');
  std::ofstream(in("key.toml")) << "[body]\nmodel = \"steak\"\n" << key << " = 1\n";
  std::ofstream(in("text.toml")) << "[body]\nmodel = \"" << key << "\"\n";
  std::ofstream(in("cells.toml")) << "[body]\nmodel = \"steak\"\n[lattice]\ncell_size = [1e-300, 1, 1]\n";
  for (const std::string& command :
       {"run " + in("key.toml") + " -o " + in("x"), "run " + in("text.toml") + " -o " + in("x"),
        "run " + in("cells.toml") + " -o " + in("x"), "info " + name, "info " + name + ".obj",
        "make " + name + " -o " + in("x"), "view --port " + name, name}) {
    const Outcome out = kerf(command);
    EXPECT_EQ(out.status, 2) << command.substr(0, 20) << out.text.substr(0, 100);
    EXPECT_LT(out.text.size(), 2500u) << command.substr(0, 20);
  }
  EXPECT_THAT(kerf("run " + in("key.toml") + " -o " + in("x")).text, HasSubstr("kkk\" in [body]; known are"));
  EXPECT_THAT(kerf("run " + in("cells.toml") + " -o " + in("x")).text, HasSubstr("e+299 cells along axis 1"));
}

// A name says what is in the file, by whatever it is read later. It is asked before the work and before a folder is made.
TEST_F(ProgramTest, FilesEndAsTheyAreRead) {
  ASSERT_EQ(kerf("make strip -o " + in("s")).status, 0);
  const std::string bind = "bind " + in("s/visual.obj") + " -o ";
  for (const auto& [outputs, known] : std::vector<std::pair<std::string, std::string>>{
           {in("new/a.kerf") + " --write-collision " + in("new/mid.xyz"),
            "mid.xyz: the made collision mesh is written as .obj or .ply"},
           {in("new/a.kerf") + " --write-collision " + in("new/mid"), "written as .obj or .ply"},
           {in("new/a.kerf") + " --write-collision " + in("new/mid.stl"), "written as .obj or .ply"},
           {in("new/a.kerf") + " --diagnose " + in("new/judged.obj"),
            "judged.obj: the judged surface is written as .ply"},
           {in("new/a.obj"), "a.obj: the body is written as .kerf"}}) {
    const Outcome out = kerf(bind + outputs);
    EXPECT_EQ(out.status, 2) << out.text;
    EXPECT_THAT(out.text, HasSubstr(known));
    EXPECT_FALSE(std::filesystem::exists(in("new")));
  }
  const Outcome recorded = kerf("run sheet -o " + in("new") + " --record " + in("r.obj"));
  EXPECT_EQ(recorded.status, 2);
  EXPECT_THAT(recorded.text, HasSubstr("r.obj: the recording is written as .kerfrec"));
  EXPECT_FALSE(std::filesystem::exists(in("new")));
  EXPECT_THAT(kerf("bench page -o " + in("page.obj") + " " + in("measured.json")).text,
              HasSubstr("page.obj: the page is written as .md"));
  EXPECT_EQ(kerf("bind " + in("s/visual.obj") + " -q -o " + in("a.kerf") + " --write-collision " + in("m.PLY")).status,
            0);
  EXPECT_EQ(kerf("info " + in("m.PLY")).status, 0);
}

// Summaries can be left out; what may be wrong with a body can't.
TEST_F(ProgramTest, NotesAreSaidHoweverQuietItIs) {
  std::ofstream(in("thick.toml"))
      << "[body]\nvisual = \"s/visual.obj\"\ncollision = \"s/collision.obj\"\nthickness = 0.01\n"
         "[simulation]\nduration = 0.002\n[output]\npicture = false\n";
  ASSERT_EQ(kerf("make closed-sheet --visual-triangles 2000 -o " + in("s")).status, 0);
  const std::string to_file = "apart() { \"$@\" > " + in("summary") + "; }; apart";
  for (const std::string& command :
       {"bind " + in("s/visual.obj") + " -c " + in("s/collision.obj") + " --thickness 0.01 -o " + in("a.kerf"),
        "run " + in("thick.toml") + " -o " + in("out")})
    for (const char* quiet : {"", " -q"}) {
      const Outcome errors = kerf(command + quiet, to_file);
      EXPECT_EQ(errors.status, 0) << errors.text;
      EXPECT_THAT(errors.text, HasSubstr("note: ")) << command << quiet;
      std::ifstream file(in("summary"));
      const std::string summary(std::istreambuf_iterator<char>(file), {});
      EXPECT_THAT(summary, ::testing::Not(HasSubstr("note: ")));
      EXPECT_EQ(summary.empty(), *quiet != 0) << summary;
    }
  EXPECT_THAT(kerf("bind --help").text, HasSubstr("notes, warnings"));
}

TEST_F(ProgramTest, NoMoreCollisionTrianglesThanTheSurfaceShows) {
  ASSERT_EQ(kerf("make closed-sheet -o " + in("s")).status, 0);
  const Outcome out = kerf("bind " + in("s/visual.obj") + " --triangles 100000 -o " + in("a.kerf"));
  EXPECT_EQ(out.status, 2) << out.text;
  EXPECT_THAT(out.text, HasSubstr("100000 collision triangles are more than the surface shows: it has "));
}

// What is said of counts and borders is true of one surface, and it is said of which.
// Steps of 4 ms do not end where frames of 50 ms are due. The nearest step has each; some were taken twice, 57 for 41.
TEST_F(ProgramTest, FramesAreAsManyAsAskedForAndEvenlySpaced) {
  struct Case {
    double per_second, step;
    int frames;
  };
  for (const Case& c : {Case{20, 0.004, 21}, Case{30, 0.004, 31}, Case{7, 0.0167, 8}, Case{1000, 0.01, 101}}) {
    std::ofstream(in("frames.toml"))
        << "[body]\nmodel = \"strip\"\noptions = { visual_triangles = 0 }\n[simulation]\ntime_step = " << c.step
        << "\nduration = 1\n[output]\nmeshes = []\npicture = false\nanimation = false\npositions = true\n"
        << "frames_per_second = " << c.per_second << "\n";
    std::filesystem::remove_all(in("out"));
    const Outcome run = kerf("run " + in("frames.toml") + " --out " + in("out") + " -q");
    ASSERT_EQ(run.status, 0) << run.text;
    std::ifstream file(in("out/positions.pvd"));
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    std::vector<double> times;
    for (std::size_t at = 0; (at = text.find("timestep=\"", at)) != std::string::npos;)
      times.push_back(std::stod(text.substr(at += 10)));
    EXPECT_EQ(times.size(), static_cast<std::size_t>(c.frames)) << c.per_second;
    for (std::size_t i = 0; i < times.size(); ++i)
      EXPECT_LE(std::abs(times[i] - static_cast<double>(i) * std::max(1 / c.per_second, c.step)), 0.5 * c.step + 1e-9)
          << c.per_second << " " << i;
  }
}

TEST_F(ProgramTest, InfoSpeaksOfOneSurface) {
  const auto write = [&](const char* name, const std::string& faces) {
    std::ofstream(in(name)) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" << faces;
    return kerf("info " + in(name)).text;
  };
  const std::string whole = write("whole.obj", "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  EXPECT_THAT(whole, HasSubstr("surface    closed, 1 piece"));
  EXPECT_THAT(whole, HasSubstr("checks     nothing to mend\n"));
  EXPECT_THAT(
      whole,
      HasSubstr("unchecked  whether the body is thin, and whether it passes through itself; kerf bind checks that"));
  EXPECT_THAT(whole, ::testing::Not(HasSubstr("as repaired")));
  for (const std::string& mended : {write("turned.obj", "f 1 3 2\nf 1 4 2\nf 2 3 4\nf 3 1 4\n"),
                                    write("twice.obj", "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 3 1 4\n")}) {
    EXPECT_THAT(mended, HasSubstr("repair     "));
    EXPECT_THAT(
        mended,
        HasSubstr("all that follows is of the surface as repaired\ncounts     4 vertices, 6 edges, 4 triangles"));
    EXPECT_THAT(mended, HasSubstr("surface    closed, 1 piece"));
    EXPECT_THAT(mended, ::testing::Not(HasSubstr("nothing to mend")));
  }
  const std::string unusable = write("three.obj", "f 1 2 3\nf 2 1 4\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 3 2\n");
  EXPECT_THAT(unusable, ::testing::Not(HasSubstr("surface    open")));
}

TEST_F(ProgramTest, FilesThatAreNotTextSaySo) {
  const auto utf16 = [&](const char* name, const std::string& text) {
    std::ofstream file(in(name), std::ios::binary);
    for (const char c : text) file << c << '\0';
  };
  utf16("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  utf16("a.toml", "[body]\nmodel = \"steak\"\n");
  for (const char* name : {"a.obj", "a.toml"}) {
    const Outcome out = kerf("info " + in(name));
    EXPECT_EQ(out.status, 2);
    EXPECT_THAT(out.text, HasSubstr(std::string(name) + ": the file is UTF-16; save it as UTF-8"));
  }
  std::ofstream(in("junk.toml"), std::ios::binary) << "\xc3\x18\x0c\x61\x22\xca\xce\x32";
  EXPECT_THAT(kerf("info " + in("junk.toml")).text, HasSubstr("junk.toml: this is not a text file"));
  std::ofstream(in("cut.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf";
  EXPECT_THAT(
      kerf("info " + in("cut.obj")).text,
      HasSubstr(
          "cut.obj:5: a face needs at least three corners, this one has 0; complete or remove it; it is the last line: "
          "the file may be cut off"));
  std::ofstream(in("inside.obj")) << "v 0 0 0\nf\nv 1 0 0\n";
  EXPECT_THAT(kerf("info " + in("inside.obj")).text, ::testing::Not(HasSubstr("last line")));
}

// A strip wound through itself: there is a collision mesh, but it does not bind.
TEST_F(ProgramTest, WhatDoesNotBindIsSavedToBeLookedAt) {
  std::ofstream strip(in("strip.obj"));
  const int n = 120;
  for (int i = 0; i <= n; ++i)
    for (int k = 0; k < 4; ++k) {
      const double a = 7.7 * i / n, r = 0.05 + (k == 1 || k == 2 ? 0.006 : 0) + 0.0005 * i / n;
      strip << "v " << r * std::cos(a) << ' ' << r * std::sin(a) << ' ' << (k < 2 ? 0 : 0.05) << '\n';
    }
  const auto quad = [&](int a, int b, int c, int d) {
    strip << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << "\nf " << a + 1 << ' ' << c + 1 << ' ' << d + 1 << '\n';
  };
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 4; ++k) quad(4 * i + k, 4 * i + (k + 1) % 4, 4 * i + 4 + (k + 1) % 4, 4 * i + 4 + k);
  quad(3, 2, 1, 0);
  quad(4 * n, 4 * n + 1, 4 * n + 2, 4 * n + 3);
  strip.close();
  const Outcome bind = kerf("bind " + in("strip.obj") + " --out " + in("strip.kerf") + " --write-collision " +
                            in("deep/made.obj") + " --diagnose " + in("deep/judged.ply"));
  EXPECT_NE(bind.status, 0) << bind.text;
  EXPECT_THAT(bind.text, HasSubstr("passes through itself"));
  EXPECT_FALSE(std::filesystem::exists(in("strip.kerf")));
  EXPECT_TRUE(std::filesystem::exists(in("deep/judged.ply")));
  EXPECT_THAT(bind.text, HasSubstr("does not bind"));
  EXPECT_THAT(bind.text, HasSubstr(", at ("));
  EXPECT_TRUE(std::filesystem::exists(in("deep/made.obj")));
  EXPECT_EQ(kerf("info " + in("deep/made.obj")).status, 0);
}

TEST_F(ProgramTest, ScenesAreFoundFromAnyFolder) {
  std::filesystem::create_directories(in("mine"));
  std::ofstream(in("mine/special.toml")) << "title = \"Mine\"\n[body]\nmodel = \"sheet\"\n";
  EXPECT_THAT(kerf("info special", "cd / && KERF_SCENES=" + in("nothing") + ":" + in("mine")).text, HasSubstr("Mine"));
  EXPECT_THAT(kerf("info special", "cd " + in("mine") + " &&").text, HasSubstr("Mine"));
  EXPECT_EQ(kerf("info steak", "cd / &&").status, 0);
  EXPECT_THAT(kerf("info --scenes").text, HasSubstr("steak\n"));
}

TEST_F(ProgramTest, EveryShippedSceneIsDescribed) {
  std::istringstream names(kerf("info --scenes").text);
  int described = 0;
  for (std::string name; names >> name;) {
    const Outcome info = kerf("info " + name);
    if (info.status == 2 && info.text.find("there is no file") != std::string::npos)
      continue;  // its meshes are elsewhere
    EXPECT_EQ(info.status, 0) << name << ": " << info.text;
    ++described;
  }
  EXPECT_GT(described, 5);
  std::ofstream(in("all.toml")) << R"([body]
model = "sheet"
[[command]]
at = 0
type = "punch"
radius = 0.1
point = [0, 0, 0]
take = true
[[command]]
at = 0.1
type = "punch"
shape = "polygon"
points = [[0, 0], [0.1, 0], [0, 0.1]]
point = [0, 0, 0]
[[command]]
at = 0.2
type = "shave"
radius = 0.01
poses = [{ time = 0, base = [0, 0, 1], tip = [0, 0, -1] }, { time = 0.1, base = [0.1, 0, 1], tip = [0.1, 0, -1] }]
[[command]]
at = 0.4
type = "remove"
sphere = { center = [0, 0, 0], radius = 0.1 }
[[command]]
at = 0.5
type = "grasp"
id = "piece"
point = [0, 0, 0]
[[command]]
at = 0.6
type = "remove"
grasp = "piece"
)";
  const Outcome all = kerf("info " + in("all.toml"));
  EXPECT_EQ(all.status, 0);
  for (const char* line :
       {"0.000 s punch, circle of radius 0.1 m, world frame, takes", "0.100 s punch, 3 corners",
        "0.200 s shave, 2 poses in 0.1 s", "0.400 s remove loose pieces", "0.600 s remove what \"piece\" holds"})
    EXPECT_THAT(all.text, HasSubstr(line));
}

TEST_F(ProgramTest, InfoOfASurfaceThatIsTooLargeSaysSo) {
  for (const char* size : {"1e308", "1e200"}) {
    std::ofstream(in("huge.obj")) << "v 0 0 0\nv " << size << " 0 0\nv 0 " << size << " 0\nv -" << size
                                  << " 0 1\nf 1 2 3\nf 1 3 4\n";
    const Outcome info = kerf("info " + in("huge.obj"));
    EXPECT_EQ(info.status, 0);
    EXPECT_THAT(info.text, HasSubstr("unusable   "));
    EXPECT_THAT(info.text, HasSubstr("give `scale`"));
    EXPECT_THAT(info.text, testing::Not(testing::ContainsRegex("inf |inf\n|nan")));
  }
}

TEST_F(ProgramTest, AModelIsNoSceneAndSaysHowItIsUsed) {
  const Outcome run = kerf("run mat --out " + in("out"));
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.text, HasSubstr("there is no scene \"mat\": mat is a model"));
  std::ofstream(in("one.toml")) << "body.model = \"mat\"\n";
  EXPECT_THAT(run.text, HasSubstr("body.model = \"mat\""));
  EXPECT_EQ(kerf("info " + in("one.toml")).status, 0);
}

// However quiet it is, a run says why it is none.
TEST_F(ProgramTest, ABodyTooFarOffIsRefusedQuietOrNot) {
  for (const char* quiet : {"", " --quiet"})
    for (const char* x : {"1e7", "1e100", "9e5"}) {
      std::ofstream(in("far.toml")) << "[body]\nmodel = \"strip\"\nposition = [" << x
                                    << ", 0, 0]\n[simulation]\nduration = 0.01\n";
      const Outcome far = kerf("run " + in("far.toml") + " --out " + in("x") + quiet);
      EXPECT_EQ(far.status, 2);
      EXPECT_THAT(far.text, HasSubstr("position"));
    }
}

TEST_F(ProgramTest, MakeThenInfoThenBind) {
  const Outcome make = kerf("make steak --out " + in("deep/steak"));
  ASSERT_EQ(make.status, 0) << make.text;
  EXPECT_THAT(make.text, HasSubstr("2641 vertices, 5278 triangles (closed)"));
  const Outcome info = kerf("info " + in("deep/steak/visual.obj"));
  EXPECT_EQ(info.status, 0);
  EXPECT_THAT(info.text, HasSubstr("closed, 1 piece, Euler characteristic 2"));
  EXPECT_EQ(kerf("info " + in("deep/steak/scene.toml")).status, 0);
  const Outcome bind = kerf("bind " + in("deep/steak/visual.obj") + " --collision " + in("deep/steak/collision.obj") +
                            " --out " + in("steak.kerf"));
  ASSERT_EQ(bind.status, 0) << bind.text;
  const Outcome body = kerf("info " + in("steak.kerf"));
  EXPECT_EQ(body.status, 0);
  EXPECT_THAT(body.text, HasSubstr("before re-meshing 2641 and 5278"));
  // truncated
  std::filesystem::resize_file(in("steak.kerf"), std::filesystem::file_size(in("steak.kerf")) / 2);
  EXPECT_EQ(kerf("info " + in("steak.kerf")).status, 2);
  EXPECT_EQ(kerf("bind " + in("deep/steak/visual.obj") + " --collision " + in("deep/steak/visual.obj") + " --out " +
                 in("x.kerf"))
                .status,
            2);
  EXPECT_FALSE(std::filesystem::exists(in("x.kerf")));
}

TEST_F(ProgramTest, ARunSaysWhatToolsFelt) {
  std::ofstream(in("press.toml"))
      << "[body]\nmodel = \"strip\"\nposition = [0, 0, 0.0016]\n[simulation]\ntime_step = 0.01\nduration = 0.2\n"
         "[output]\nanimation = false\npicture = false\n[[obstacle]]\nname = \"board\"\nshape = \"plane\"\n"
         "[[tool]]\nid = \"ball\"\nkind = \"sphere\"\nradius = 0.005\nposition = [0, 0, 0.006]\n";
  const Outcome run = kerf("run " + in("press.toml") + " --out " + in("press"));
  ASSERT_EQ(run.status, 0) << run.text;
  EXPECT_THAT(run.text, HasSubstr("tool \"ball\": largest force on it "));
  EXPECT_THAT(run.text, HasSubstr("deepest overlap "));
  std::ifstream file(in("press/report.json"));
  const std::string report{std::istreambuf_iterator<char>(file), {}};
  for (const char* key :
       {"largest_force", "largest_torque", "coupling_force", "pressing_most", "deepest_overlap", "force_end"})
    EXPECT_THAT(report, HasSubstr(std::string("\"") + key + "\"")) << key;
}

// A bound model needs no scene: it knows its material and lattice, and hangs by its far rim.
TEST_F(ProgramTest, ABoundModelRunsAlone) {
  ASSERT_EQ(kerf("bind steak --out " + in("steak.kerf")).status, 0);
  const Outcome info = kerf("info " + in("steak.kerf"));
  EXPECT_THAT(info.text, HasSubstr("Young's modulus"));
  EXPECT_THAT(info.text, HasSubstr("lattice    "));
  EXPECT_EQ(kerf("run " + in("steak.kerf") + " --duration 0.005 --quiet --record " + in("r.kerfrec") + " --out " +
                 in("alone"))
                .status,
            0);
  EXPECT_EQ(kerf("replay " + in("r.kerfrec")).status, 0);
  const Outcome twice = kerf("bind steak --scale 2 --out " + in("x.kerf"));
  EXPECT_EQ(twice.status, 2);
  EXPECT_THAT(twice.text, HasSubstr("is a model"));
}

// Half a run, and the other half in another process, end as one run does.
TEST_F(ProgramTest, ARunGoesOnFromASavedState) {
  std::ofstream(in("cut.toml"))
      << "[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.06\ngravity = [0, 0, -1]\n[output]\nanimation = false\npicture = false\n[[command]]\ntype = \"blade\"\nat = 0.004\n"
         "frame = \"rest\"\nposes = [ { time = 0, base = [0.001, -0.1, 0.1], tip = [0.001, -0.1, -0.1] }, "
         "{ time = 0.01, base = [0.001, 0.1, 0.1], tip = [0.001, 0.1, -0.1] } ]\n";
  const auto text_of = [&](const std::string& name) {
    std::ifstream file(in(name), std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  ASSERT_EQ(kerf("run " + in("cut.toml") + " -q -o " + in("whole")).status, 0);
  const Outcome first =
      kerf("run " + in("cut.toml") + " -q --duration 0.03 -o " + in("first") + " --save " + in("half.kerfstate"));
  ASSERT_EQ(first.status, 0) << first.text;
  const Outcome second =
      kerf("run --from " + in("half.kerfstate") + " -o " + in("second") + " --save " + in("end.kerfstate"));
  ASSERT_EQ(second.status, 0) << second.text;
  EXPECT_THAT(second.text, HasSubstr("30 steps"));
  EXPECT_TRUE(text_of("second/visual.obj") == text_of("whole/visual.obj"));
  EXPECT_FALSE(text_of("first/visual.obj") == text_of("whole/visual.obj"));

  const auto refused = [&](const std::string& command, const std::string& why) {
    const Outcome out = kerf("run " + command + " -o " + in("none"));
    EXPECT_EQ(out.status, 2) << command;
    EXPECT_THAT(out.text, HasSubstr(why)) << command;
    EXPECT_FALSE(std::filesystem::exists(in("none/visual.obj")));
  };
  refused("--from " + in("end.kerfstate"), "give a later --duration");
  refused("--from " + in("cut.toml"), "is no saved state of kerf");
  refused("steak --from " + in("half.kerfstate"), "SCENE");
  refused("--from " + in("half.kerfstate") + " --record " + in("r.kerfrec"), "--record");
  refused("--from " + in("half.kerfstate") + " --save " + in("half.kerfstate"), "half.kerfstate");
  refused("steak --save " + in("s.obj"), ".kerfstate");
  const Outcome open =
      kerf("run " + in("cut.toml") + " -q --duration 0.009 -o " + in("open") + " --save " + in("open.kerfstate"));
  EXPECT_EQ(open.status, 1);
  EXPECT_THAT(open.text, HasSubstr("save after it"));
  EXPECT_FALSE(std::filesystem::exists(in("open.kerfstate")));
}

// What scenes refuse of a material is refused before anything is written: the body that lies there stays.
TEST_F(ProgramTest, BindTakesTheMaterialsThatScenesTake) {
  ASSERT_EQ(kerf("bind strip -q -o " + in("a.kerf")).status, 0);
  const auto bytes = [&] {
    std::ifstream file(in("a.kerf"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string before = bytes();
  for (const auto& [option, why] : std::vector<std::pair<std::string, std::string>>{
           {"--poisson nan", "bind: poisson must be a finite number, but is nan"},
           {"--poisson 0.495", "bind: poisson must be at most 0.49, but is 0.495"},
           {"--poisson=-0.1", "bind: poisson must be at least 0, but is -0.1"},
           {"--young nan", "bind: young must be a finite number, but is nan"},
           {"--young 1e300", "bind: young must be at most 1"},
           {"--young 0", "bind: young must be at least 0.001, but is 0"},
           {"--density 1e300", "bind: density must be at most 1"},
           {"--density inf", "bind: density must be a finite number, but is inf"}}) {
    const Outcome out = kerf("bind strip -o " + in("a.kerf") + " " + option);
    EXPECT_EQ(out.status, 2) << option << out.text;
    EXPECT_THAT(out.text, HasSubstr(why));
    EXPECT_EQ(bytes(), before) << option;
  }
  EXPECT_EQ(kerf("bind strip -q -o " + in("a.kerf") + " --young 1e13 --poisson 0.49 --density 1e6").status, 0);
}

TEST_F(ProgramTest, CutsThroughOneLayerOrAllAndFilesInMillimetres) {
  const std::string along = "cut tube --from 0,-0.06,0 --to 0,0.06,0 --along 0,0,1 --out " + in("cut");
  EXPECT_THAT(kerf(along).text, HasSubstr("1 piece;"));
  EXPECT_THAT(kerf(along + " --through").text, HasSubstr("2 pieces;"));
  ASSERT_EQ(kerf("make steak --out " + in("steak")).status, 0);
  const std::string files =
      "cut " + in("steak/visual.obj") + " --collision " + in("steak/collision.obj") + " --out " + in("cut");
  EXPECT_THAT(kerf(files + " --from -0.12,0,0 --to 0.12,0,0").text, HasSubstr("2 pieces;"));
  EXPECT_THAT(kerf(files + " --scale 10 --from -1.2,0,0 --to 1.2,0,0").text, HasSubstr("2 pieces;"));
  ASSERT_EQ(kerf("bind strip -q -o " + in("strip.kerf")).status, 0);
  for (const std::string& body : {std::string("steak"), in("strip.kerf")})
    for (const char* option : {" --scale 10", " --weld 0.001"}) {
      const Outcome model = kerf("cut " + body + option + " --from -0.12,0,0 --to 0.12,0,0 --out " + in("cut"));
      EXPECT_EQ(model.status, 2) << option;
      EXPECT_THAT(model.text, HasSubstr("--scale and --weld are for mesh files"));
    }
  for (const std::string& file : {std::string("steak"), in("strip.kerf")})
    for (const char* option : {" --scale 10", " --weld 0.001"}) {
      const Outcome info = kerf("info " + file + option);
      EXPECT_EQ(info.status, 2) << option;
      EXPECT_THAT(info.text, HasSubstr("is no mesh file; leave --scale and --weld out"));
    }
}

TEST_F(ProgramTest, CutsThatCannotBeSayWhy) {
  ASSERT_EQ(kerf("make steak --out " + in("steak")).status, 0);
  const std::string to = " --to 0.12,0,0 --out " + in("x");
  const Outcome mesh = kerf("cut " + in("steak/visual.obj") + " --from -0.12,0,0" + to);
  EXPECT_EQ(mesh.status, 0) << mesh.text;  // its collision mesh is made
  const Outcome none = kerf("cut stek --from -0.12,0,0" + to);
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.text, HasSubstr("models: sheet"));
  const Outcome air = kerf("cut steak --from 5,5,5 --to 6,5,5 --out " + in("x"));
  EXPECT_EQ(air.status, 2);
  EXPECT_THAT(air.text, HasSubstr("met nothing"));
  const Outcome normal = kerf("cut steak --from 0,0,-1 --to 0,0,1 --out " + in("x"));
  EXPECT_EQ(normal.status, 2);
  EXPECT_THAT(normal.text, HasSubstr("--along"));
}

TEST_F(ProgramTest, StepsWithoutEndAreRefused) {
  std::ofstream(in("s.toml")) << "[body]\nmodel = \"sheet\"\n[simulation]\ntime_step = 1e-300\n";
  const Outcome run = kerf("run " + in("s.toml") + " --out " + in("x"));
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.text, HasSubstr("larger time_step"));
}

TEST_F(ProgramTest, ALatticeThatTakesTooMuchMemoryIsRefused) {
  std::ofstream(in("s.toml"))
      << "[body]\nmodel = \"strip\"\n[lattice]\ncells = [40, 40, 40]\n[simulation]\nduration = 0\n";
  for (const std::string& command :
       {"run " + in("s.toml") + " -q --out " + in("x"), "view " + in("s.toml") + " --no-browser --page " + in(".")}) {
    std::ofstream(in("index.html")) << "<html></html>";
    const Outcome refused = kerf(command + " --memory 100MB");
    EXPECT_EQ(refused.status, 2) << refused.text;
    EXPECT_THAT(refused.text, HasSubstr(":4: [lattice]: 40 x 40 x 40 cells"));
    EXPECT_THAT(refused.text, HasSubstr("100 MB are the most (--memory)"));
  }
  std::ofstream(in("small.toml")) << "[body]\nmodel = \"sheet\"\n[output]\npicture = false\nanimation = false\n";
  const std::string run = "run " + in("small.toml") + " -q --duration 0 --out " + in("x");
  EXPECT_EQ(kerf(run + " --memory 100MB").status, 0);
  EXPECT_EQ(kerf(run + " --memory 1000").status, 2);
  EXPECT_EQ(kerf("cut sheet --from 0,0,0 --to 1,0,0 --out " + in("y") + " --memory 1kB").status, 2);
  for (const char* size : {"much", "0", "-1GB"}) {
    const Outcome bad = kerf(run + " --memory=" + size);
    EXPECT_EQ(bad.status, 2) << size;
    EXPECT_THAT(bad.text, HasSubstr("is no size: 4GB, 500MB, 2GiB, or bytes"));
  }
}

TEST_F(ProgramTest, AFolderThatCannotBeMade) {
  std::ofstream(in("file")) << "x";
  const Outcome out = kerf("make sheet --out " + in("file/below"));
  EXPECT_EQ(out.status, 2);
  EXPECT_THAT(out.text, HasSubstr("can't make the folder"));
  std::filesystem::create_symlink("nowhere", in("link"));
  const Outcome link = kerf("make sheet --out " + in("link"));
  EXPECT_EQ(link.status, 2);
  EXPECT_THAT(link.text, HasSubstr("link: a link of that name leads nowhere; choose another place"));
}

// What is wrong with a body is said with the name of its file.
TEST_F(ProgramTest, CutNamesTheFileThatItRefuses) {
  std::ofstream(in("far.obj")) << "v 100000 0 0\nv 100000.1 0 0\nv 100000.1 0.1 0\nv 100000 0.1 0\nf 1 2 3\nf 1 3 4\n";
  const Outcome bind = kerf("bind " + in("far.obj") + " --thickness 0.002 -q -o " + in("far.kerf"));
  ASSERT_EQ(bind.status, 0) << bind.text;
  EXPECT_THAT(bind.text,
              HasSubstr("far.kerf: kerf run, view and cut refuse this body as it is: the body lies 1e+05 m"));
  const Outcome cut = kerf("cut " + in("far.kerf") + " --from 100000,0,0 --to 100001,0,0 -o " + in("out"));
  EXPECT_EQ(cut.status, 2);
  EXPECT_THAT(cut.text, HasSubstr("far.kerf: the body lies 1e+05 m from the origin"));
}

}  // namespace
}  // namespace kerf::app::program_test
