// The program: its commands and their options. What they do stands in command_*.cpp. Only this file sees
// CLI11, which is slow to compile and throws.
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "command_bench.h"
#include "command_bind.h"
#include "command_cut.h"
#include "command_info.h"
#include "command_make.h"
#include "command_replay.h"
#include "command_run.h"
#include "command_view.h"
#include "exit_status.h"
#include "kerf/base/byte_count.h"
#include "kerf/base/memory_limit.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/closest_word.h"
#include "mesh_folders.h"
#include "number_checks.h"
#include "scene_search.h"
#include "terminal.h"

namespace {

using namespace kerf;
using namespace kerf::app;

/// Three numbers with commas: 0.1,-2,3e-2.
Vec3 parse_vec3(const std::string& text) {
  Vec3 v;
  const char* at = text.data();
  const char* end = at + text.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, error] = std::from_chars(at, end, v[i]);
    const bool separated = i < 2 ? next < end && *next == ',' : next == end;
    if (error != std::errc() || !separated)
      throw CLI::ValidationError("\"" + text + "\" is not X,Y,Z: three numbers with commas");
    at = next + 1;
  }
  if (!is_finite(v)) throw CLI::ValidationError("\"" + text + "\" is not finite");
  return v;
}

CLI::Option* add_vec3(CLI::App* command, const std::string& name, const std::function<void(Vec3)>& set,
                      const std::string& doc) {
  return command
      ->add_option_function<std::string>(
          name, [set](const std::string& text) { set(parse_vec3(text)); }, doc)
      ->type_name("X,Y,Z");
}

/// How much memory lattices may take. In force from its parsing to the end of the program.
void add_memory(CLI::App* command, std::optional<MemoryLimit>& limit) {
  command
      ->add_option_function<std::string>(
          "--memory",
          [&limit](const std::string& text) {
            const auto bytes = parse_bytes(text);
            if (!bytes || *bytes == 0)
              throw CLI::ValidationError("--memory", "\"" + text + "\" is no size: 4GB, 500MB, 2GiB, or bytes");
            limit.emplace(*bytes);
          },
          "Refuse lattices that would take more, such as 4GB or 500MB; default: half of what is free")
      ->type_name("SIZE");
}

void add_run(CLI::App& app, RunOptions& options, std::optional<MemoryLimit>& memory, std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("run", "Simulate a scene and write what came of it");
  CLI::App* begin = command->add_option_group("what to run", "");
  begin->add_option("SCENE", options.scene, "A scene file, the name of a shipped scene, or a body saved by kerf bind");
  CLI::Option* from = begin->add_option("--from", options.from, "Go on from a state that --save wrote");
  begin->require_option(1);
  command->add_option("-o,--out", options.out, "Folder for the results; made when it does not exist")->required();
  command->add_option("--duration", options.duration, "Simulate up to this many seconds instead of the scene's")
      ->check(CLI::Validator(is_not_negative, ">= 0"));
  command->add_option("--threads", options.threads, "Threads to use; 0: all cores")->check(CLI::Range(0, 1024));
  command->add_option("--meshes", options.meshes, kMeshesHelp)->check(CLI::ExistingDirectory);
  command->add_option("--record", options.record, "Write a recording that kerf replay repeats bit by bit")
      ->excludes(from);
  command->add_option("--save", options.save, "Write the state at the end: --from goes on from it, to the bit");
  command->add_flag("-q,--quiet", options.quiet, kQuietHelp);
  std::string scenes;
  for (const std::string& name : shipped_scenes()) scenes += (scenes.empty() ? "" : ", ") + name;
  add_memory(command, memory);
  command->footer("Shipped scenes: " + scenes +
                  "\n\nExamples:\n"
                  "  kerf run steak --out out/steak           cuts a steak; the results lie in out/steak\n"
                  "  kerf run my/scene.toml --out out/mine    mesh files in it are relative to the scene\n"
                  "  kerf run steak --out out/a --save a.kerfstate\n"
                  "  kerf run --from a.kerfstate --duration 9 --out out/b\n"
                  "                                           goes on with the cut steak, up to 9 s\n"
                  "  kerf info --schema                       what a scene can say\n\n"
                  "Results: report.json (counts, times, residuals, checks), visual.obj and visual_rest.obj,\n"
                  "collision.obj, hexahedra.vtu, body.glb (animation), picture.png.\n"
                  "Exit status: 0 success, 1 the run failed, 2 bad input.");
  command->callback([&options, &chosen] { chosen = [&options] { return run_scene(options); }; });
}

void add_weld(CLI::App& command, std::optional<double>& weld) {
  command
      .add_option(
          "--weld", weld,
          "Metres: corners this close become one; 0: none. Default: those at one place that the file does not keep apart")
      ->check(CLI::NonNegativeNumber);
}

void add_bind(CLI::App& app, BindOptions& options, std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("bind", "Bind a visual mesh to a collision mesh and save the body");
  command
      ->add_option("VISUAL", options.visual,
                   "Mesh that is drawn: OBJ, PLY, STL or OFF, closed or an open sheet; or a model's name")
      ->required();
  CLI::Option* collision =
      command->add_option("-c,--collision", options.collision,
                          "Mesh of the mid-surface, with a border; without it one is made from a closed visual mesh");
  command->add_option("-o,--out", options.out, "File for the bound body (.kerf)")->required();
  command
      ->add_option(
          "--triangles", options.triangles,
          "Triangles of the collision mesh that is made, at most as many as VISUAL has, or 1500; default: 160, or what the bends need")
      ->check(CLI::Range(std::size_t{8}, std::size_t{100000}))
      ->excludes(collision);
  command->add_option("--write-collision", options.write_collision, "Save the collision mesh that is made (OBJ or PLY)")
      ->excludes(collision);
  command
      ->add_option("--diagnose", options.diagnose,
                   "Save the surface as it was judged (PLY): sides, confidence, thickness, what speaks against it")
      ->excludes(collision);
  command->add_option("--scale", options.scale, "Metres per unit of the files")
      ->check(CLI::Validator(is_positive, "> 0"))
      ->capture_default_str();
  command->add_option("--thickness", options.thickness, "Metres; needed by an open visual mesh")
      ->check(CLI::Validator(is_positive, "> 0"));
  add_weld(*command, options.weld);
  command->add_option("--young", options.young,
                      "Young's modulus in Pa, kept in the file: scenes use it where they say none");
  command->add_option("--poisson", options.poisson, "Poisson's ratio, kept in the file");
  command->add_option("--density", options.density, "kg/m3, kept in the file");
  command->add_flag("--exact", options.exact_paths, "Exact geodesic paths: slower, a little shorter");
  command->add_flag("-q,--quiet", options.quiet, kQuietHelp);
  command->footer(
      "Examples:\n"
      "  kerf make steak --out steak && kerf bind steak/visual.obj --collision steak/collision.obj --out "
      "steak.kerf\n"
      "  kerf bind meniscus.stl --scale 0.001 --out meniscus.kerf     makes the collision mesh; the file is in millimetres\n"
      "  kerf bind knee.stl --collision knee-middle.obj --scale 0.001 --young 3.85e6 --out knee.kerf\n"
      "  kerf bind meniscus --out meniscus.kerf                       a model, with its material and lattice\n"
      "kerf view and kerf run take the result as it is; a scene uses it with:  [body] bound = \"steak.kerf\"");
  command->callback([&options, &chosen] { chosen = [&options] { return bind_meshes(options); }; });
}

void add_make(CLI::App& app, MakeOptions& options, std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("make", "Generate a model: visual mesh, collision mesh and a scene");
  command->add_option("MODEL", options.model, "One of the models below")->required();
  command->add_option("-o,--out", options.out, "Folder for the files; made when it does not exist")->required();
  command->add_option("--visual-triangles", options.options.visual_triangles, "Triangles of the visual mesh");
  command->add_option("--collision-triangles", options.options.collision_triangles, "Triangles of the collision mesh");
  command->add_option("--rim-radius", options.options.rim_radius, "closed-sheet: how far the rim bulges, metres");
  command->add_option("--bend", options.options.bend, "Bend by this angle, radians");
  command->add_option("--bumps", options.options.bumps, "Height of smooth bumps, metres");
  command->add_option("--noise", options.options.noise, "Random displacements of visual vertices, metres");
  command->add_option("--seed", options.options.seed, "Of bumps and noise")
      ->check(CLI::Validator(is_whole, ">= 0"))
      ->capture_default_str();
  command->add_option("--format", options.format, "obj or ply")
      ->check(CLI::IsMember({"obj", "ply"}))
      ->capture_default_str();
  command->add_flag("--replace", options.replace, "Replace files in the folder that are not what would be written");
  std::string models;
  for (const ModelName& model : model_names()) {
    models += "  " + std::string(model.name) + std::string(model.name.size() < 14 ? 14 - model.name.size() : 1, ' ') +
              std::string(model.description) + "\n";
  }
  command->footer("Models:\n" + models +
                  "\nExamples:\n"
                  "  kerf make steak --out steak\n"
                  "  kerf make sheet --visual-triangles 106496 --out sheet");
  command->callback([&options, &chosen] { chosen = [&options] { return make_meshes(options); }; });
}

void add_info(CLI::App& app, InfoOptions& options, std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("info", "Describe a mesh, a scene or a bound body");
  command->add_option("FILE", options.file,
                      "A mesh (OBJ, PLY, STL, OFF), a scene (TOML or a shipped name) or a body (.kerf)");
  command->add_option("--scale", options.scale, "Metres per unit of a mesh, as for kerf bind")
      ->check(CLI::Validator(is_positive, "> 0"))
      ->capture_default_str();
  add_weld(*command, options.weld);
  command->add_flag("--schema", options.schema,
                    "Everything a scene file can say: keys, types, units, ranges, defaults");
  command->add_flag("--markdown", options.markdown, "With --schema: as Markdown");
  command->add_flag("--scenes", options.scenes, "Names of the shipped scenes");
  command->footer(
      "Examples:\n"
      "  kerf info knee.stl            counts, size, area, volume, borders, pieces, and what is wrong with "
      "it\n"
      "  kerf info steak               what happens in a scene\n"
      "  kerf info --schema | less");
  command->callback([&options, &chosen] { chosen = [&options] { return show_info(options); }; });
}

void add_cut(CLI::App& app, CutOptions& options, std::optional<MemoryLimit>& memory, std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("cut", "Make one cut in a body, without a scene");
  command
      ->add_option("BODY", options.body,
                   "A body saved by kerf bind, a visual mesh (with --collision), or a model's name")
      ->required();
  command->add_option("-c,--collision", options.collision, "Mesh of the mid-surface, when BODY is a visual mesh");
  command->add_option("--thickness", options.thickness, "Metres; needed by an open visual mesh")
      ->check(CLI::Validator(is_positive, "> 0"));
  command->add_option("--scale", options.scale, "Metres per unit of the mesh files; --from and --to are metres")
      ->check(CLI::Validator(is_positive, "> 0"))
      ->capture_default_str();
  add_weld(*command, options.weld);
  add_vec3(
      command, "--from", [&options](Vec3 v) { options.from = v; }, "Where the cut starts, metres")
      ->required();
  add_vec3(
      command, "--to", [&options](Vec3 v) { options.to = v; }, "Where it ends")
      ->required();
  add_vec3(
      command, "--along", [&options](Vec3 v) { options.along = v; },
      "Direction of the blade's edge; default: through the thickness");
  command->add_flag("--through", options.through, "Cut every layer that the blade meets, not only the first");
  command->add_option("-o,--out", options.out, "Folder for the results; made when it does not exist")->required();
  add_memory(command, memory);
  command->footer(
      "Examples:\n"
      "  kerf cut steak --from -0.12,0,0 --to 0.12,0,0 --out out/halves\n"
      "  kerf cut knee.kerf --from 0,0.01,0 --to 0,0.02,0 --out out/tear\n"
      "  kerf cut knee.stl --scale 0.001 --from 0,0.01,0 --to 0,0.02,0 --out out/tear     the file is in millimetres\n"
      "  kerf cut tube --through --from 0,-0.06,0 --to 0,0.06,0 --along 0,0,1 --out out/tube     both walls\n"
      "The cut runs straight from --from to --to; points off the body are fine, it is cut where the blade "
      "meets it.");
  command->callback([&options, &chosen] { chosen = [&options] { return cut_body(options); }; });
}

/// Empty, or what is wrong with a token.
std::string is_token(const std::string& token) {
  const bool plain = std::all_of(token.begin(), token.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
  if (plain && token.size() >= 8 && token.size() <= 128) return {};
  return "a token is 8 to 128 letters, digits, - and _";
}

void add_view(CLI::App& app, ViewOptions& options, std::optional<MemoryLimit>& memory, std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("view", "Cut it yourself, in a browser");
  command->add_option(
      "SCENE", options.scene,
      "A scene file, the name of a shipped scene, or a body saved by kerf bind; default: steak-on-a-board");
  CLI::Option* port =
      command
          ->add_option("-p,--port", options.port, "Port of this machine; 0: any. Default: 8080, or the next free one")
          ->check(CLI::Range(0, 65535));
  command->add_option("--listen", options.listen,
                      "Address to listen on; default: this machine only. Others (0.0.0.0: all) are for tablets and "
                      "headsets");
  command
      ->add_option(
          "--token", options.token,
          "What an address must end with to use the session: 8 to 128 letters, digits, - and _. Default: a new "
          "one that nobody can guess")
      ->check(CLI::Validator(is_token, "WORD"));
  command->add_option("--page", options.page, "Serve the page from this folder instead of the built-in one");
  command->add_option("--meshes", options.meshes, kMeshesHelp)->check(CLI::ExistingDirectory);
  command
      ->add_option(
          "--origin", options.origins,
          "Name of a proxy that leads here, such as cut.example.org or https://cut.example.org:8443; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--time-step", options.time_step, "Seconds, instead of the scene's")
      ->check(CLI::Validator(is_positive, "> 0"));
  command->add_flag("--no-browser", options.no_browser, "Print the address, open nothing");
  command->add_flag("--scripted", options.scripted, "Run the scene's own commands too");
  add_memory(command, memory);
  command->footer(
      "Examples:\n"
      "  kerf view                     a steak on its board, in a browser\n"
      "  kerf view meniscus --port 9000\n"
      "  kerf view steak --listen 0.0.0.0   for a tablet in the same network\n"
      "Stop with Ctrl-C.");
  command->callback([&options, port, &chosen] {
    options.port_given = port->count() > 0;
    chosen = [&options] { return view_scene(options); };
  });
}

void add_replay(CLI::App& app, ReplayOptions& options, std::optional<MemoryLimit>& memory,
                std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("replay", "Repeat a recording and compare the bits");
  command->add_option("FILE", options.file, "A recording (.kerfrec)")->required();
  command->add_option("--compare", options.compare,
                      "Repeat this recording too; say where the two first differ, and both scores");
  command
      ->add_option("--meshes", options.meshes,
                   "Folder with meshes that were too large to travel in the recording; several times: several")
      ->check(CLI::ExistingDirectory);
  command->add_flag("-q,--quiet", options.quiet, kQuietHelp);
  add_memory(command, memory);
  command->footer(
      "Examples:\n"
      "  kerf replay mine.kerfrec\n"
      "  kerf replay mine.kerfrec --compare yours.kerfrec\n"
      "Exit status: 0 the same bits as recorded, 1 other ones (the first differing step is named), 2 bad input.");
  command->callback([&options, &chosen] { chosen = [&options] { return replay_file(options); }; });
}

void add_bench(CLI::App& app, BenchCommand& options, BenchPage& page, std::optional<MemoryLimit>& memory,
               std::function<int()>& chosen) {
  CLI::App* command = app.add_subcommand("bench", "Measure: the paper's tables, how cost grows");
  command->require_subcommand(1);
  const auto add_measuring = [&](const char* name, const char* what) {
    CLI::App* one = command->add_subcommand(name, what);
    one->add_option("-o,--out", options.out, "Folder for JSON, CSV and SVG; made when it does not exist");
    one->add_option("--cuts", options.cuts, "Cuts per body")->check(CLI::Range(1, 100000))->capture_default_str();
    one->add_option("--rows", options.rows, "Only the tables whose name contains this: table-2, visual, ...");
    one->add_flag("--quick", options.quick, "Small bodies and few cuts: does it still run?");
    one->add_flag("-q,--quiet", options.quiet, "No progress and no tables");
    add_memory(one, memory);
    one->callback([&options, &chosen, name] {
      options.what = name;
      chosen = [&options] { return run_bench(options); };
    });
  };
  add_measuring("paper", "Every table and figure of the paper's section 5, beside its values");
  add_measuring("scale", "Cost by size of each mesh, by number of cuts, by threads");
  CLI::App* pages = command->add_subcommand("page", "Make one page of what paper and scale wrote");
  pages->add_option("FILES", page.files, "Their JSON files")->required();
  pages->add_option("-o,--out", page.out, "The page (Markdown)")->required();
  pages->add_option("--pictures", page.pictures, "Folder of the plots, relative to the page")->capture_default_str();
  pages->callback([&page, &chosen] { chosen = [&page] { return write_bench_page(page); }; });
  command->footer(
      "Examples:\n"
      "  kerf bench paper --out out/bench                   about ten minutes\n"
      "  kerf bench scale --rows visual                     one table\n"
      "  kerf bench page out/bench/*.json --out results.md");
}

/// What is wrong with a word that stands where a command must; empty: no such word does.
std::string unknown_command(const CLI::App& app) {
  const CLI::App* last = &app;
  std::string before;
  for (auto chosen = last->get_subcommands(); !chosen.empty(); chosen = last->get_subcommands()) {
    last = chosen.front();
    before += last->get_name() + " ";
  }
  const std::vector<std::string> words = last->remaining();
  if (last->get_require_subcommand_min() == 0 || words.empty() || words.front().starts_with('-')) return {};
  std::vector<std::string> names;
  for (const CLI::App* command : last->get_subcommands(nullptr)) names.push_back(before + command->get_name());
  std::vector<std::string_view> known;
  known.reserve(names.size());
  for (const std::string& name : names) known.push_back(std::string_view(name).substr(before.size()));
  const std::string_view closest = closest_word(words.front(), known);
  std::string text = "there is no command \"" + before + words.front() + "\"; ";
  if (!closest.empty()) return text + "did you mean \"" + before + std::string(closest) + "\"?";
  text += "there are ";
  for (const std::string& name : names) text += (&name == &names.front() ? "" : ", ") + name;
  return text;
}

/// Says what the machine lacks; false when this is about something else.
bool say_what_lacks(const std::exception& error) {
  const char* lacks = what_lacks(error);
  if (lacks) warn("kerf: {}\n", lacks);
  return lacks != nullptr;
}

/// The same where an exception can't come through: TBB takes its threads up again in a destructor.
void say_and_end() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::exception& error) {
    if (say_what_lacks(error)) std::_Exit(kRunFailed);
  } catch (...) {}
  std::abort();
}

/// Was all that was printed written?
bool printed() {
  std::cout.flush();
  if (std::cout.good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  std::fputs("kerf: the standard output can't be written; is its disk full?\n", stderr);
  return false;
}

/// Runs a command; what the machine lacks ends it with a sentence, not with a crash. Files stay as they were: whole_file.h.
int run_guarded(const std::function<int()>& chosen) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows over the limit is an error like a full disk
  int status = kRunFailed;
  try {
    status = chosen();
  } catch (const std::exception& error) {
    if (!say_what_lacks(error)) warn("kerf: the system can't go on: {}\n", error.what());
  }
  if (printed()) return status;
  return status == kSuccess ? kRunFailed : status;
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(say_and_end);
  CLI::App app("Kerf cuts thin deformable solids in real time.", "kerf");
  app.set_version_flag("--version", "kerf " KERF_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(32);
  app.footer(
      "Start with:\n"
      "  kerf run steak --out out/steak\n"
      "kerf COMMAND --help explains a command with examples.");
  app.failure_message([](const CLI::App* command, const CLI::Error& error) {
    const std::string unknown = unknown_command(*command);
    const CLI::Error printed(error.get_name(), shown(unknown.empty() ? error.what() : unknown, kMostOfSentence),
                             error.get_exit_code());
    return CLI::FailureMessage::simple(command, printed);  // arguments may hold what only a terminal would understand
  });
  std::function<int()> chosen;
  std::optional<MemoryLimit> memory;
  RunOptions run;
  add_run(app, run, memory, chosen);
  BindOptions bind;
  add_bind(app, bind, chosen);
  MakeOptions make;
  add_make(app, make, chosen);
  InfoOptions info;
  add_info(app, info, chosen);
  CutOptions cut;
  add_cut(app, cut, memory, chosen);
  ViewOptions view;
  add_view(app, view, memory, chosen);
  ReplayOptions replay;
  add_replay(app, replay, memory, chosen);
  BenchCommand bench;
  BenchPage bench_page;
  add_bench(app, bench, bench_page, memory, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::ostringstream wrong;
    const int status = app.exit(error, std::cout, wrong);
    if (!wrong.str().empty()) put(stderr, "kerf: " + wrong.str());
    if (status != 0) return kBadInput;
    return printed() ? kSuccess : kRunFailed;  // --help, --version
  }
  return run_guarded(chosen);
}
