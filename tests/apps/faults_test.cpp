// What goes wrong around the program: full disks, limits, files that vanish or change, kills in the middle of saving. A clear
// sentence, never a crash; what was there stays, whole.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "apps/program_path.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"

namespace kerf::app::faults_test {
namespace {

using ::testing::HasSubstr;

struct Outcome {
  int status = -1;   ///< of the program, or of the shell that could not start it
  int signal = 0;    ///< that ended it
  std::string text;  ///< stdout and stderr
};

std::string contents(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class Faults : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() /
        ("kerf_faults_" + std::to_string(::getpid()) + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string in(const std::string& name) const { return (folder_ / name).string(); }

  /// Runs the program; `prepare` happens in the child before it.
  Outcome kerf(const std::vector<std::string>& arguments, const std::function<void()>& prepare = {},
               const char* stdout_to = nullptr) {
    const std::string log = in("output.txt"), program = test::program_path();
    const pid_t child = ::fork();
    if (child == 0) {
      const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
      ::dup2(file, STDERR_FILENO);
      ::dup2(stdout_to ? ::open(stdout_to, O_WRONLY) : file, STDOUT_FILENO);
      if (prepare) prepare();
      std::vector<char*> list{const_cast<char*>(program.c_str())};
      for (const std::string& argument : arguments) list.push_back(const_cast<char*>(argument.c_str()));
      list.push_back(nullptr);
      ::execv(program.c_str(), list.data());
      ::_exit(126);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    Outcome out;
    if (WIFEXITED(status)) out.status = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) out.signal = WTERMSIG(status);
    out.text = contents(log);
    return out;
  }
  /// Starts a run of many minutes, and waits until its report says so. To be killed.
  [[nodiscard]] pid_t start_long_run(const std::string& scene, const std::string& out) const {
    const std::string program = test::program_path();
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl(program.c_str(), program.c_str(), "run", scene.c_str(), "--duration", "1000", "-q", "-o", out.c_str(),
              nullptr);
      ::_exit(126);
    }
    for (int i = 0; i < 2000 && contents(out + "/report.json").find("\"running\"") == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return child;
  }
  [[nodiscard]] std::vector<std::string> names_in(const std::string& folder) const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(in(folder)))
      found.push_back(entry.path().filename().string());
    return found;
  }
  [[nodiscard]] std::vector<std::string> left_over() const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_))
      if (entry.path().string().find(".part") != std::string::npos) found.push_back(entry.path().string());
    return found;
  }

  std::filesystem::path folder_;
};

void limit(int what, rlim_t size) {
  const rlimit value{size, size};
  ::setrlimit(static_cast<__rlimit_resource>(what), &value);
}

TEST_F(Faults, DeviceThatIsFull) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  const Outcome body = kerf({"bind", in("v.obj"), "-c", in("c.obj"), "-o", "/dev/full"});
  EXPECT_EQ(body.status, 2) << body.text;  // no such meshes yet
  ASSERT_EQ(kerf({"make", "steak", "-o", in("steak")}).status, 0);
  const Outcome bound = kerf({"bind", in("steak/visual.obj"), "-c", in("steak/collision.obj"), "-o", "/dev/full"});
  EXPECT_EQ(bound.status, 1) << bound.text;
  EXPECT_THAT(bound.text, HasSubstr("No space left"));
  const Outcome recorded = kerf({"run", "island", "--duration", "0.01", "-o", in("out"), "--record", "/dev/full"});
  EXPECT_EQ(recorded.status, 1) << recorded.text;
  EXPECT_THAT(recorded.text, HasSubstr("No space left"));
  // What it prints can't be written either.
  const Outcome printed = kerf({"info", "steak"}, {}, "/dev/full");
  EXPECT_EQ(printed.status, 1) << printed.text;
  EXPECT_EQ(printed.signal, 0);
  for (const char* what : {"--help", "--version"}) {
    const Outcome help = kerf({what}, {}, "/dev/full");
    EXPECT_EQ(help.status, 1) << what;
    EXPECT_THAT(help.text, HasSubstr("standard output can't be written"));
    EXPECT_EQ(kerf({what}).status, 0);
  }
}

// Where the results go is looked at before the work.
TEST_F(Faults, PlacesThatCannotBeWrittenAreRefusedFirst) {
  std::filesystem::create_directories(in("folder"));
  std::filesystem::create_directories(in("folder.ply"));
  const std::string scene = in("long.toml");
  std::ofstream(scene) << "[body]\nmodel = \"steak\"\n[simulation]\nduration = 1000\n";
  const auto refused = [&](std::vector<std::string> command, const std::string& file, const char* why) {
    command.push_back(file);
    const Outcome out = kerf(command);
    EXPECT_EQ(out.status, 2) << out.text;
    EXPECT_THAT(out.text, HasSubstr(why));
  };
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"run", scene, "-q", "-o", in("out"), "--record"}, {"bind", "steak", "-q", "-o"}}) {
    refused(command, in("folder"), "is a folder");
    refused(command, in(std::string(300, 'x')), "too long");
  }
  refused({"bind", "steak", "-o", in("x.kerf"), "--diagnose"}, in("folder.ply"), "is a folder");
  refused({"bind", "steak", "-o", in("x.kerf"), "--diagnose"}, in(std::string(300, 'x') + ".ply"), "too long");
  refused({"bind", "steak", "-o"}, "", "no file name given");
  // Every result is looked at, not the report alone.
  std::ofstream(in("quick.toml")) << "[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.002\n";
  std::filesystem::create_directories(in("taken/visual.obj"));
  std::filesystem::create_directories(in("bench/scale.json"));
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"run", in("quick.toml"), "-q", "-o"},
                                             {"cut", "strip", "--from", "0,-0.1,0", "--to", "0,0.1,0", "-o"},
                                             {"make", "strip", "-o"}}) {
    refused(command, in("taken"), "taken/visual.obj: is a folder");
    EXPECT_THAT(names_in("taken"), testing::ElementsAre("visual.obj")) << command[0];
  }
  refused({"bench", "scale", "--quick", "-q", "-o"}, in("bench"), "bench/scale.json: is a folder");
  EXPECT_THAT(left_over(), testing::IsEmpty());
}

// What a command writes takes the place of nothing that it reads, and of nothing else that it writes; by whatever name.
TEST_F(Faults, NoResultReplacesWhatItIsMadeFrom) {
  ASSERT_EQ(kerf({"make", "strip", "-o", in("s")}).status, 0);
  std::ofstream(in("s/scene.toml"), std::ios::app) << "[simulation]\nduration = 0.002\n[output]\npicture = false\n";
  std::filesystem::copy(in("s/collision.obj"), in("s/tool.obj"));
  std::filesystem::create_directory_symlink("s", in("link"));
  std::filesystem::create_symlink("s/visual.obj", in("visual-link.obj"));
  std::filesystem::create_hard_link(in("s/visual.obj"), in("visual-hard.obj"));
  std::filesystem::create_symlink("new.kerf", in("dangling.kerf"));
  const std::string scene = in("s/scene.toml"), visual = in("s/visual.obj"), collision = in("s/collision.obj");
  std::ofstream(in("tools.toml"))
      << "[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.002\n[[tool]]\nid = \"t\"\nkind = \"mesh\"\n"
         "mesh = \"s/visual.obj\"\nposition = [0, 0, 1]\n[[obstacle]]\nshape = \"mesh\"\nmesh = \"s/collision.obj\"\nposition = [0, 0, 2]\n";
  ASSERT_EQ(kerf({"bind", "strip", "-o", in("body.kerf")}).status, 0);
  std::map<std::string, std::string> before;
  for (const char* name : {"s/scene.toml", "s/visual.obj", "s/collision.obj", "s/tool.obj", "tools.toml", "body.kerf"})
    before[name] = contents(in(name));
  const std::vector<std::string> cut{"--from", "-0.2,0,0", "--to", "0.2,0,0"};
  const auto refused = [&](const std::vector<std::string>& command, const std::string& output,
                           const std::string& other) {
    const Outcome out = kerf(command);
    EXPECT_EQ(out.status, 2) << out.text;
    EXPECT_THAT(out.text, HasSubstr(output + " would replace "));
    EXPECT_THAT(out.text, HasSubstr(other + ": they are the same file"));
    for (const auto& [name, bytes] : before) EXPECT_EQ(contents(in(name)), bytes) << name;
  };
  refused({"run", scene, "-q", "-o", in("s")}, visual, visual);
  refused({"run", scene, "-q", "-o", in("link")}, in("link/visual.obj"), visual);
  refused({"run", scene, "-q", "-o", in("s/not-there/..")}, in("s/not-there/../visual.obj"), visual);
  EXPECT_FALSE(std::filesystem::exists(in("s/not-there")));
  refused({"run", in("tools.toml"), "-q", "-o", in("s")}, visual, visual);
  refused({"run", in("tools.toml"), "-q", "-o", in("o"), "--record", in("tools.toml")}, in("tools.toml"),
          in("tools.toml"));
  refused({"run", in("tools.toml"), "-q", "-o", in("o"), "--record", in("visual-link.obj")}, in("visual-link.obj"),
          visual);
  refused({"run", in("tools.toml"), "-q", "-o", in("o"), "--record", in("visual-hard.obj")}, in("visual-hard.obj"),
          visual);
  refused({"run", in("body.kerf"), "-q", "-o", in("o"), "--record", in("body.kerf")}, in("body.kerf"), in("body.kerf"));
  refused({"run", "sheet", "-q", "-o", in("o"), "--record", in("o/../o/report.json")}, in("o/../o/report.json"),
          in("o/report.json"));
  EXPECT_FALSE(std::filesystem::exists(in("o"))) << "refused before anything is made";
  refused({"bind", visual, "-c", collision, "-o", visual}, visual, visual);
  refused({"bind", visual, "-c", collision, "-o", in("visual-link.obj")}, in("visual-link.obj"), visual);
  refused({"bind", visual, "-o", in("w.obj"), "--write-collision", in("w.obj")}, in("w.obj"), in("w.obj"));
  refused({"bind", visual, "-o", in("dangling.kerf"), "--diagnose", in("new.kerf")}, in("new.kerf"),
          in("dangling.kerf"));
  std::vector<std::string> meshes{"cut", visual, "-c", collision, "-o", in("s")};
  meshes.insert(meshes.end(), cut.begin(), cut.end());
  refused(meshes, visual, visual);
  std::filesystem::create_directories(in("twice"));
  std::filesystem::create_symlink("visual.obj", in("twice/collision.obj"));
  refused({"make", "strip", "-o", in("twice")}, in("twice/collision.obj"), in("twice/visual.obj"));
  std::ofstream(in("m.json")) << "{}";
  refused({"bench", "page", in("m.json"), "-o", in("m.json")}, in("m.json"), in("m.json"));
  // Beside each other they may stand; a device may get everything.
  EXPECT_EQ(kerf({"run", scene, "-q", "-o", in("s/out"), "--record", in("s/r.kerfrec")}).status, 0);
  EXPECT_EQ(kerf({"run", scene, "-q", "-o", in("s/out"), "--record", in("s/r.kerfrec")}).status, 0)
      << "over the results of before";
  for (const auto& [name, bytes] : before) EXPECT_EQ(contents(in(name)), bytes) << name;
}

constexpr const char* kQuick = "[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.002\n[output]\npicture = false\n";

TEST_F(Faults, AReportSaysHowItsRunEnded) {
  const auto report = [&](const char* folder) { return contents(in(std::string(folder) + "/report.json")); };
  // A frame that can't be written ends a run.
  std::ofstream(in("frames.toml")) << kQuick << "positions = true\n";
  std::filesystem::create_directories(in("broken/positions_000000.vtu"));
  const Outcome broken = kerf({"run", in("frames.toml"), "-q", "-o", in("broken")});
  EXPECT_EQ(broken.status, 1) << broken.text;
  EXPECT_THAT(report("broken"), HasSubstr("\"status\": \"failed\""));
  EXPECT_THAT(report("broken"), HasSubstr("positions_000000.vtu: is a folder"));
  EXPECT_THAT(report("broken"), HasSubstr("\"simulated_seconds\": 0.0,"));
  EXPECT_TRUE(std::filesystem::exists(in("broken/visual.obj"))) << "what there is is written";
  std::ofstream(in("whole.toml")) << kQuick;
  EXPECT_EQ(kerf({"run", in("whole.toml"), "-q", "-o", in("whole")}).status, 0);
  EXPECT_THAT(report("whole"), HasSubstr("\"status\": \"complete\""));
  EXPECT_THAT(report("whole"), testing::Not(HasSubstr("reason")));
  EXPECT_EQ(kerf({"cut", "strip", "--from", "5,5,5", "--to", "6,5,5", "-o", in("air")}).status, 2);
  EXPECT_THAT(report("air"), HasSubstr("\"reason\": \"cut: the blade met nothing"));
  EXPECT_EQ(kerf({"cut", "strip", "--from", "0,-0.1,0", "--to", "0,0.1,0", "-o", in("air")}).status, 0);
  EXPECT_THAT(report("air"), HasSubstr("\"status\": \"complete\""));
}

// Also while its bodies are made, when there is no session yet. What is refused leaves an earlier run's results as they are.
TEST_F(Faults, AReportSaysThatTheBodiesCouldNotBeMade) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer needs address space";
#endif
  std::ofstream(in("small.toml")) << kQuick;
  std::ofstream(in("large.toml"))
      << "title = \"many cells\"\n[body]\nmodel = \"closed-sheet\"\n[lattice]\ncells = [300, 300, 2]\n";
  std::ofstream(in("wrong.toml")) << "[body]\nmodel = \"strip\"\n[lattice]\ncells = [30000, 30000, 10000]\n";
  const std::string report = in("out/report.json");
  ASSERT_EQ(kerf({"run", in("small.toml"), "-q", "-o", in("out")}).status, 0);
  const std::string complete = contents(report);
  const Outcome refused = kerf({"run", in("wrong.toml"), "-q", "-o", in("out")});
  EXPECT_EQ(refused.status, 2) << refused.text;
  EXPECT_EQ(contents(report), complete);
  for (const char* folder : {"out", "new"}) {
    const Outcome large = kerf({"run", in("large.toml"), "--threads", "1", "--memory", "100GB", "-q", "-o", in(folder)},
                               [] { limit(RLIMIT_AS, rlim_t{150} << 20); });
    EXPECT_EQ(large.status, 1) << large.text;
    const std::string why = in("large.toml") + ":5: [lattice]: not enough memory to make 300 x 300 x 2 cells";
    EXPECT_THAT(large.text, HasSubstr("kerf: " + why));
    const std::string told = contents(in(std::string(folder) + "/report.json"));
    EXPECT_THAT(told, HasSubstr("\"status\": \"failed\""));
    EXPECT_THAT(told, HasSubstr("\"reason\": \"" + why));
    EXPECT_THAT(told, HasSubstr("\"title\": \"many cells\""));
    EXPECT_THAT(told, HasSubstr("\"body.glb\""));
  }
  ASSERT_TRUE(std::filesystem::exists(in("out/body.glb"))) << "what is there of the earlier run, the report names";
}

// A punch that is found to be too small at its time does not cost the run.
TEST_F(Faults, ACommandThatTheBodyRefusesIsNotedInTheReport) {
  std::ofstream(in("late.toml"))
      << "[body]\nmodel = \"steak\"\n[simulation]\nduration = 0.006\n[output]\npicture = false\n"
         "[[command]]\nat = 0.004\ntype = \"punch\"\npoint = [0.05, 0, 0]\nradius = 0.001\n";
  const Outcome late = kerf({"run", in("late.toml"), "-o", in("late")});
  EXPECT_EQ(late.status, 0) << late.text;
  EXPECT_THAT(late.text, HasSubstr("note: " + in("late.toml") + ":7: punch: too small"));
  const std::string report = contents(in("late/report.json"));
  EXPECT_THAT(report, HasSubstr("\"status\": \"complete\""));
  EXPECT_THAT(report, HasSubstr("late.toml:7: punch: too small"));
  EXPECT_THAT(report, HasSubstr("; this command of 0.004 s was skipped"));
  EXPECT_THAT(report, HasSubstr("\"simulated_seconds\": 0.006,"));
}

// Killed in the middle, a run leaves a report that does not look like that of a finished one, and that knows what is still there of an earlier one.
TEST_F(Faults, AKilledRunLeavesAReportThatSaysRunning) {
  const std::string all = in("all.toml"), few = in("few.toml"), out = in("out"), report = in("out/report.json");
  std::ofstream(all) << kQuick << "positions = true\n";
  std::ofstream(few) << kQuick << "animation = false\nmeshes = [\"visual\"]\n";
  ASSERT_EQ(kerf({"run", all, "-q", "-o", out}).status, 0);
  ASSERT_THAT(contents(report), HasSubstr("\"complete\""));
  const pid_t child = start_long_run(few, out);
  // Another one may not write there meanwhile, and changes nothing.
  const Outcome second = kerf({"run", all, "-q", "-o", in("out/../out")});
  EXPECT_EQ(second.status, 2) << second.text;
  EXPECT_THAT(second.text, HasSubstr(in("out/../out") + ": another program is writing its results there"));
  EXPECT_EQ(kerf({"cut", "strip", "--from", "0,-0.1,0", "--to", "0,0.1,0", "-o", out}).status, 2);
  EXPECT_THAT(contents(report), HasSubstr("\"running\""));
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_THAT(contents(report), HasSubstr("\"running\""));
  for (const char* name : {"visual.obj", "body.glb", "hexahedra.vtu", "positions.pvd"})
    EXPECT_THAT(contents(report), HasSubstr(name));
  // What it leaves keeps nobody off.
  EXPECT_EQ(kerf({"run", few, "-q", "-o", out}).status, 0);
  EXPECT_THAT(names_in("out"),
              testing::UnorderedElementsAre("visual.obj", "visual_rest.obj", "steps.svg", "report.json"));
}

// Killed before it could remove what an earlier run has left, a run leaves that to the next.
TEST_F(Faults, WhatAKilledRunDidNotRemoveTheNextDoes) {
  std::ofstream(in("few.toml")) << kQuick << "animation = false\nmeshes = []\n";
  std::filesystem::create_directories(in("out"));
  for (const char* name : {"body.glb", "positions_000007.vtu", "notes.txt", "body.glb.kerf.part-0",
                           "positions_000008.vtu.kerf.part-1", "notes.txt.kerf.part-0"})
    std::ofstream(in(std::string("out/") + name)) << "old";
  std::ofstream(in("out/report.json"))
      << "{\"kerf_report_version\": 1, \"status\": \"running\", \"files\": [\"steps.svg\", \"body.glb\", \"positions.pvd\"]}";
  ASSERT_EQ(kerf({"run", in("few.toml"), "-q", "-o", in("out")}).status, 0);
  EXPECT_THAT(names_in("out"),
              testing::UnorderedElementsAre("steps.svg", "report.json", "notes.txt", "notes.txt.kerf.part-0"));
}

// What an earlier run has left and the next does not write goes as that begins; what is somebody else's stays.
TEST_F(Faults, ResultsOfTwoRunsAreNotMixed) {
  const auto scene = [&](const char* name, const std::string& output) {
    std::ofstream(in(name)) << "[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.002\n" << output;
    return in(name);
  };
  const auto names = [&] { return names_in("out"); };
  const std::string all = scene("all.toml", "[output]\npicture = false\npositions = true\n");
  const std::string few = scene("few.toml", "[output]\npicture = false\nanimation = false\nmeshes = [\"visual\"]\n");
  ASSERT_EQ(kerf({"run", all, "-q", "-o", in("out")}).status, 0);
  EXPECT_THAT(names(), testing::IsSupersetOf(
                           {"body.glb", "collision.obj", "hexahedra.vtu", "positions.pvd", "positions_000000.vtu"}));
  for (const std::string& name : names()) {  // the report knows all files of its run
    if (name.starts_with("positions_")) continue;
    EXPECT_THAT(contents(in("out/report.json")), HasSubstr("\"" + name + "\""));
  }
  std::ofstream(in("out/positions_mine.vtu")) << "mine";
  std::ofstream(in("out/picture.png")) << "mine";  // the report names no picture
  ASSERT_EQ(kerf({"run", few, "-q", "-o", in("out")}).status, 0);
  EXPECT_THAT(names(), testing::UnorderedElementsAre("visual.obj", "visual_rest.obj", "steps.svg", "report.json",
                                                     "positions_mine.vtu", "picture.png"));
  // What the next run reads is no result to it.
  const std::string reads = scene(
      "reads.toml",
      "[output]\npicture = false\nanimation = false\nmeshes = []\n[[obstacle]]\nshape = \"mesh\"\nmesh = \"out/visual.obj\"\n"
      "position = [0, 0, 1]\n");
  const std::string visual = contents(in("out/visual.obj"));
  const Outcome read = kerf({"run", reads, "-q", "-o", in("out")});
  ASSERT_EQ(read.status, 0) << read.text;
  EXPECT_EQ(contents(in("out/visual.obj")), visual);
  EXPECT_THAT(names(), testing::Not(testing::Contains("visual_rest.obj")));
  // A report of somebody else says nothing of files here, nor does one that names other things.
  std::ofstream(in("out/report.json"))
      << "{\"kerf_report_version\": 1, \"files\": [\"positions_mine.vtu\", \"../all.toml\", 7]}";
  ASSERT_EQ(kerf({"run", few, "-q", "-o", in("out")}).status, 0);
  EXPECT_THAT(names(), testing::Contains("positions_mine.vtu"));
  EXPECT_TRUE(std::filesystem::exists(all));
}

TEST_F(Faults, FilesOverALimitLeaveTheOldOnes) {
  ASSERT_EQ(kerf({"make", "steak", "-o", in("steak")}).status, 0);
  const std::string before = contents(in("steak/visual.obj"));
  const Outcome made =
      kerf({"make", "steak", "--noise", "0.0001", "--replace", "-o", in("steak")}, [] { limit(RLIMIT_FSIZE, 20000); });
  EXPECT_EQ(made.signal, 0);
  EXPECT_EQ(made.status, 1) << made.text;
  EXPECT_THAT(made.text, HasSubstr("visual.obj"));
  EXPECT_THAT(made.text, HasSubstr("free space"));
  EXPECT_EQ(contents(in("steak/visual.obj")), before);
  EXPECT_THAT(left_over(), testing::IsEmpty());
}

// What somebody has put into a file since is not lost unasked.
TEST_F(Faults, MakeReplacesNoWorkUnasked) {
  for (const std::string format : {"obj", "ply"}) {
    const std::string folder = in(format), scene = folder + "/scene.toml", visual = folder + "/visual." + format;
    const auto make = [&](std::vector<std::string> more) {
      more.insert(more.begin(), {"make", "strip", "--format", format, "-o", folder});
      return kerf(more);
    };
    ASSERT_EQ(make({}).status, 0);
    const std::string scene_before = contents(scene), visual_before = contents(visual);
    EXPECT_EQ(make({}).status, 0) << "the same bytes";
    const auto refused = [&](const Outcome& out, const std::string& file) {
      EXPECT_EQ(out.status, 2) << out.text;
      EXPECT_THAT(out.text, HasSubstr("kerf: " + file + ": is there already"));
      EXPECT_THAT(out.text, HasSubstr("--out"));
      EXPECT_THAT(out.text, HasSubstr("--replace"));
    };
    std::ofstream(scene, std::ios::app) << "# my work\n";
    refused(make({}), scene);
    EXPECT_EQ(contents(scene), scene_before + "# my work\n");
    refused(kerf({"make", "tube", "--format", format, "-o", folder}), visual);
    EXPECT_EQ(contents(visual), visual_before);
    EXPECT_EQ(make({"--replace"}).status, 0);
    EXPECT_EQ(contents(scene), scene_before);
    // Cut off, or longer by a byte.
    std::filesystem::resize_file(visual, visual_before.size() - 1);
    refused(make({}), visual);
    std::ofstream(visual, std::ios::binary) << visual_before << '\n';
    refused(make({}), visual);
    std::ofstream(visual, std::ios::trunc).close();
    refused(make({}), visual);
  }
}

TEST_F(Faults, ReadOnlyFolder) {
  const auto set = [&](std::filesystem::perms p) { std::filesystem::permissions(folder_ / "locked", p); };
  std::filesystem::create_directories(folder_ / "locked");
  set(std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  const auto as_nobody = [] {
    if (::getuid() != 0) return;
    if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(125);  // root may write anywhere
  };
  std::filesystem::permissions(folder_, std::filesystem::perms::all);
  const Outcome out = kerf({"make", "steak", "-o", in("locked")}, as_nobody);
  if (out.status == 125 || out.status == 126) GTEST_SKIP() << "can't become another user here";
  EXPECT_NE(out.status, 0);
  EXPECT_EQ(out.signal, 0);
  EXPECT_THAT(out.text, HasSubstr("because the folder " + in("locked") + " takes no new files (Permission denied)"));
  const Outcome inside = kerf({"make", "steak", "-o", in("locked/deeper")}, as_nobody);
  EXPECT_EQ(inside.status, 2) << inside.text;
  set(std::filesystem::perms::owner_all);
}

// Whatever moment the program is killed at, the file is the old one or a new one.
TEST_F(Faults, KilledWhileSaving) {
  const std::string file = in("body/visual.obj");
  ASSERT_EQ(kerf({"make", "closed-sheet", "--visual-triangles", "30000", "-o", in("body")}).status, 0);
  const std::string one = contents(file);
  ASSERT_EQ(
      kerf({"make", "closed-sheet", "--visual-triangles", "30000", "--noise", "0.001", "--replace", "-o", in("body")})
          .status,
      0);
  const std::string two = contents(file);
  ASSERT_NE(one, two);
  const std::string program = test::program_path();
  int killed = 0;
  for (int i = 0; i < 24; ++i) {
    const pid_t child = ::fork();
    if (child == 0) {
      const int nowhere = ::open("/dev/null", O_WRONLY);
      ::dup2(nowhere, STDOUT_FILENO);
      const std::string noise = i % 2 ? "0" : "0.001", out = in("body");
      ::execl(program.c_str(), program.c_str(), "make", "closed-sheet", "--visual-triangles", "30000", "--noise",
              noise.c_str(), "--replace", "-o", out.c_str(), nullptr);
      ::_exit(126);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2 + 5 * i));
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    killed += WIFSIGNALED(status) ? 1 : 0;
    const std::string now = contents(file);
    ASSERT_TRUE(now == one || now == two) << "broken after a kill, " << now.size() << " bytes";
  }
  EXPECT_GT(killed, 0);
}

TEST_F(Faults, LittleMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer needs address space";
#endif
  int refused = 0;
  for (const rlim_t megabytes : {30, 60, 120, 200, 300, 500, 800}) {
    const Outcome out = kerf({"run", "island", "--duration", "0.05", "--quiet", "-o", in("out")},
                             [&] { limit(RLIMIT_AS, megabytes << 20); });
    EXPECT_EQ(out.signal, 0) << megabytes << " MB: " << out.text;
    if (out.status == 0) continue;
    if (out.status == 127 || out.text.find("shared librar") != std::string::npos)
      continue;  // the loader itself had too little
    ++refused;
    EXPECT_EQ(out.status, 1) << megabytes << " MB: " << out.text;
    EXPECT_THAT(out.text, HasSubstr("kerf: ")) << megabytes;
  }
  EXPECT_GT(refused, 0);
}

// A file that does not fit into memory is named.
TEST_F(Faults, AFileLargerThanMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer needs address space";
#endif
  ASSERT_EQ(kerf({"bind", "sheet", "-o", in("large.kerf")}).status, 0);
  std::ofstream(in("large.obj")) << "v 0 0 0\n";
  for (const char* name : {"large.kerf", "large.obj"}) {
    std::filesystem::resize_file(in(name), std::uintmax_t{1} << 31);
    const Outcome out = kerf({"info", in(name)}, [] { limit(RLIMIT_AS, rlim_t{1} << 30); });
    EXPECT_EQ(out.status, 2) << out.text;
    EXPECT_THAT(out.text, HasSubstr(in(name) + ": not enough memory to read it"));
  }
  // The bytes fit, what they hold does not.
  std::ofstream points(in("points.obj"));
  for (int i = 0; i < 3'000'000; ++i) points << "v 1 2 3\n";
  points.close();
  const Outcome out = kerf({"info", in("points.obj")}, [] { limit(RLIMIT_AS, rlim_t{80} << 20); });
  EXPECT_EQ(out.status, 2) << out.text;
  EXPECT_THAT(out.text, HasSubstr(in("points.obj") + ": not enough memory to read it"));
}

// What is named and is no file is said to be what it is.
TEST_F(Faults, NamesOfWhatIsNoFile) {
  std::filesystem::create_directories(in("d.toml"));
  std::filesystem::create_symlink("pong", in("ping"));
  std::filesystem::create_symlink("ping", in("pong"));
  std::filesystem::create_symlink("ping", in("ping.toml"));
  std::filesystem::create_symlink("nowhere", in("lost.toml"));
  ASSERT_EQ(::mkfifo(in("pipe.toml").c_str(), 0600), 0);
  const std::string longest = in(std::string(300, 'x'));
  const auto refused = [&](const std::vector<std::string>& command, const std::string& why) {
    const Outcome out = kerf(command);
    EXPECT_EQ(out.status, 2) << out.text;
    EXPECT_THAT(out.text, HasSubstr(why)) << command[0] << ' ' << command[1];
  };
  const auto scene = [&](const std::string& name, const std::string& why) {
    refused({"run", in(name), "-o", in("out")}, in(name) + ": " + why);
    refused({"info", in(name)}, in(name) + ": " + why);
    refused({"view", in(name), "--no-browser"}, in(name) + ": " + why);
  };
  scene("d.toml", "is a folder");
  scene("pipe.toml", "is not a regular file");
  scene("ping.toml", "is a symbolic link that leads round in a circle");
  scene("lost.toml", "is a symbolic link that leads nowhere");
  refused({"run", "/dev/null", "-o", in("out")}, "/dev/null: is not a regular file");
  refused({"run", in("d"), "-o", in("out")}, "d.toml: is a folder");
  EXPECT_EQ(kerf({"run", "steak", "-o", ""}).status, 2);
  EXPECT_THAT(kerf({"run", "steak", "-o", ""}).text, HasSubstr("the folder for the results has no name"));
  // Meshes.
  const std::vector<std::string> cut{"--from", "0,0,0", "--to", "1,0,0", "-o", in("out")};
  for (const std::string& name : {in("ping"), in("ping.stl"), longest}) {
    if (name == in("ping.stl")) std::filesystem::create_symlink("ping", name);
    const std::string why = name == longest ? "" : "its symbolic links lead round in a circle";
    refused({"bind", name, "-o", in("x.kerf")}, why);
    refused({"info", name}, name == in("ping") ? "round in a circle" : why);
    std::vector<std::string> whole{"cut", name};
    whole.insert(whole.end(), cut.begin(), cut.end());
    refused(whole, why);
  }
  EXPECT_THAT(kerf({"bind", longest, "-o", in("x.kerf")}).text, HasSubstr("name is too long"));
}

// Where no second thread can be had, the program says so; one thread is enough for it.
TEST_F(Faults, NoThreads) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer needs threads and address space";
#endif
  std::filesystem::permissions(folder_, std::filesystem::perms::all);
  const auto alone = [] {
    limit(RLIMIT_NPROC, 1);
    if (::getuid() == 0 && (::setgid(65534) != 0 || ::setuid(65534) != 0)) ::_exit(125);  // root may have any number
  };
  const Outcome probe = kerf({"info", "steak"}, alone);
  if (probe.status == 125 || probe.status == 126) GTEST_SKIP() << "can't become another user here";
  const Outcome one =
      kerf({"run", "steak", "--threads", "1", "--duration", "0.005", "--quiet", "-o", in("one")}, alone);
  EXPECT_EQ(one.status, 0) << one.text;
  EXPECT_EQ(one.signal, 0);
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "one core: no other thread is wanted";
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"run", "steak", "--duration", "0.005", "--quiet", "-o", in("all")},
           {"run", "steak", "--threads", "2", "--duration", "0.005", "-q", "-o", in("two")},
           {"bench", "scale", "--quick", "--rows", "threads", "-q"}}) {
    const Outcome out = kerf(command, alone);
    EXPECT_EQ(out.signal, 0) << out.text;
    EXPECT_EQ(out.status, 1) << out.text;
    EXPECT_THAT(out.text, HasSubstr("kerf: no thread could be made"));
    EXPECT_THAT(out.text, HasSubstr("--threads 1"));
  }
}

TEST_F(Faults, FilesThatVanishOrAreBeingWritten) {
  ASSERT_EQ(kerf({"make", "steak", "-o", in("steak")}).status, 0);
  const std::string whole = contents(in("steak/visual.obj"));
  // Half-written: what is there is refused by name, or is a smaller mesh that is not closed; never a crash.
  for (const double part : {0.0, 0.01, 0.3, 0.5, 0.77, 0.9999}) {
    std::ofstream(in("half.obj"), std::ios::binary)
        << whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size())));
    const Outcome out = kerf({"bind", in("half.obj"), "-c", in("steak/collision.obj"), "-o", in("half.kerf")});
    EXPECT_EQ(out.status, 2) << part << ": " << out.text;
    EXPECT_THAT(out.text, HasSubstr("half.obj")) << part;
    EXPECT_FALSE(std::filesystem::exists(in("half.kerf")));
  }
  // Gone between the scene and its meshes.
  std::ofstream(in("scene.toml")) << "[body]\nvisual = \"gone.obj\"\ncollision = \"steak/collision.obj\"\n";
  const Outcome gone = kerf({"run", in("scene.toml"), "-o", in("out")});
  EXPECT_EQ(gone.status, 2);
  EXPECT_THAT(gone.text, HasSubstr("gone.obj"));
  // A file that shrinks and grows while it is read, many times.
  std::atomic<bool> stop = false;
  const std::string path = in("changing.obj");
  std::ofstream(path) << whole;
  std::thread writer([&] {
    for (std::size_t i = 0; !stop; ++i) {
      std::filesystem::resize_file(path, whole.size() * (i % 7) / 7 + 1);
      std::ofstream(path, std::ios::binary) << whole;
    }
  });
  for (int i = 0; i < 60; ++i) {
    const auto mesh = read_mesh(path);
    if (mesh) continue;
    EXPECT_THAT(mesh.error().message, HasSubstr("changing.obj"));
  }
  stop = true;
  writer.join();
}

TEST_F(Faults, BoundBodiesAreSavedWholeOrNotAtAll) {
  const auto model = make_model("sheet", {.visual_triangles = 1664});
  ASSERT_TRUE(model.ok());
  BindOptions options;
  options.thickness = 0.1;
  const auto body = bind(model->visual, model->collision, options);
  ASSERT_TRUE(body.ok());
  ASSERT_TRUE(save_bound_body(*body, in("b.kerf")).ok());
  const std::string before = contents(in("b.kerf"));
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    limit(RLIMIT_FSIZE, before.size() / 2);
    ::_exit(save_bound_body(*body, in("b.kerf")).ok() ? 0 : 3);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_EQ(contents(in("b.kerf")), before);
  EXPECT_THAT(left_over(), testing::IsEmpty());
}

}  // namespace
}  // namespace kerf::app::faults_test
