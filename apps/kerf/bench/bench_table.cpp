#include "bench/bench_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace kerf::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;

Json json(const Cell& cell) {
  if (cell.is_number) return std::isfinite(cell.number) ? Json(cell.number) : Json();
  return cell.text.empty() ? Json() : Json(cell.text);
}

Json json(const Table& table) {
  Json rows = Json::array();
  for (const auto& row : table.rows) {
    Json cells = Json::array();
    for (const Cell& cell : row) cells.push_back(json(cell));
    rows.push_back(std::move(cells));
  }
  return {{"id", table.id}, {"title", table.title}, {"note", table.note}, {"columns", table.columns}, {"rows", rows}};
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out(1, '"');
  for (const char c : text) {
    if (c == '"') out += c;
    out += c;
  }
  out += '"';
  return out;
}

std::string with_commas(double whole) {
  const std::string digits = fmt::format("{:.0f}", whole);
  std::string out;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && digits[i - 1] != '-' && (digits.size() - i) % 3 == 0) out += ',';
    out += digits[i];
  }
  return out;
}

template <class T>
T text_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<T>() : T();
}

Table table_of(const nlohmann::json& object) {
  Table table{text_of<std::string>(object, "id"),
              text_of<std::string>(object, "title"),
              text_of<std::string>(object, "note"),
              {},
              {}};
  for (const auto& column : object.value("columns", nlohmann::json::array()))
    table.columns.push_back(column.is_string() ? column.get<std::string>() : "");
  for (const auto& row : object.value("rows", nlohmann::json::array())) {
    auto& cells = table.rows.emplace_back();
    for (const auto& cell : row) {
      if (cell.is_number()) cells.emplace_back(cell.get<double>());
      else if (cell.is_string()) cells.emplace_back(cell.get<std::string>());
      else cells.emplace_back();
    }
  }
  return table;
}

}  // namespace

std::string cell_text(const Cell& cell) {
  if (!cell.is_number) return cell.text;
  const double size = std::abs(cell.number);
  if (!std::isfinite(cell.number)) return "-";
  if (size < 1e15 && cell.number == std::round(cell.number)) return with_commas(cell.number);
  if (size >= 100) return with_commas(std::round(cell.number));
  const int digits = size >= 10 ? 1 : size >= 1 ? 2 : size >= 0.1 ? 3 : size >= 0.01 ? 4 : 5;
  return fmt::format("{:.{}f}", cell.number, digits);
}

std::string markdown(const Table& table) {
  std::string out = "|", rule = "|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    out += fmt::format(" {} |", table.columns[i]);
    rule += i == 0 ? "---|" : "--:|";
  }
  out += "\n" + rule + "\n";
  for (const auto& row : table.rows) {
    out += "|";
    for (const Cell& cell : row) out += fmt::format(" {} |", cell_text(cell));
    out += "\n";
  }
  return out;
}

std::string csv(const Table& table) {
  std::string out;
  const auto add = [&](const std::string& cell, bool last) {
    out += cell;
    out += last ? '\n' : ',';
  };
  for (std::size_t i = 0; i < table.columns.size(); ++i) add(quoted(table.columns[i]), i + 1 == table.columns.size());
  for (const auto& row : table.rows)
    for (std::size_t i = 0; i < row.size(); ++i)
      add(row[i].is_number ? fmt::format("{}", row[i].number) : quoted(row[i].text), i + 1 == row.size());
  return out;
}

std::string run_json(const Run& run) {
  Json machine = Json::object(), tables = Json::array(), figures = Json::array();
  for (const auto& [key, value] : run.machine) machine[key] = value;
  for (const Table& table : run.tables) tables.push_back(json(table));
  for (const Figure& figure : run.figures) figures.push_back({{"id", figure.id}, {"caption", figure.caption}});
  const Json all = {{"kerf_bench", kVersion},
                    {"program", run.program},
                    {"machine", machine},
                    {"tables", tables},
                    {"figures", figures}};
  return all.dump(1) + "\n";
}

Result<Run> parse_run(std::string_view text, std::string_view name) {
  const auto all = nlohmann::json::parse(text, nullptr, false);
  if (!all.is_object() || !all.contains("kerf_bench") || all["kerf_bench"] != kVersion)
    return bad_input(
        fmt::format("{} is no result of a benchmark (version {}); kerf bench writes such files", name, kVersion));
  Run run;
  run.program = text_of<std::string>(all, "program");
  // In the order of the file, which a sorted object does not keep.
  const auto ordered = Json::parse(text, nullptr, false);
  if (ordered.contains("machine") && ordered["machine"].is_object())
    for (const auto& [key, value] : ordered["machine"].items())
      if (value.is_string()) run.machine.emplace_back(key, value.get<std::string>());
  for (const auto& table : all.value("tables", nlohmann::json::array()))
    if (table.is_object()) run.tables.push_back(table_of(table));
  for (const auto& figure : all.value("figures", nlohmann::json::array()))
    if (figure.is_object())
      run.figures.push_back({text_of<std::string>(figure, "id"), text_of<std::string>(figure, "caption"), {}});
  return run;
}

std::string results_page(const std::vector<Run>& runs, std::string_view pictures) {
  std::string out =
      "# Results\n\n`kerf bench page` writes this page from the files of the benchmarks. [benchmarks.md](benchmarks.md) says what is measured, and "
      "how to repeat it.\n";
  for (const Run& run : runs) {
    out += fmt::format("\n## `{}`\n\n| | |\n|---|---|\n", run.program);
    for (const auto& [key, value] : run.machine) out += fmt::format("| {} | {} |\n", key, value);
    for (const Table& table : run.tables) {
      out += fmt::format("\n### {}\n\n", table.title);
      if (!table.note.empty()) out += table.note + "\n\n";
      out += markdown(table);
      for (const Figure& figure : run.figures)
        if (figure.id.starts_with(table.id))
          out += fmt::format("\n![{}]({}/{}.svg)\n", figure.caption, pictures, figure.id);
    }
  }
  return out;
}

}  // namespace kerf::bench
