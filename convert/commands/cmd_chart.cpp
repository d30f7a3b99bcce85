// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include <gsc/file/read_file.h>

#include "convert/chart/chart_figures.h"
#include "convert/chart/chart_model.h"
#include "convert/chart/chart_page.h"
#include "convert/chart/curve_model.h"
#include "convert/chart/rows/run_set.h"
#include "convert/chart/trace_model.h"
#include <gsc/file/output_file.h>
#include "runtime/cli/version.h"

#include <algorithm>
#include <filesystem>
#include <optional>

namespace gsc {

namespace {

constexpr uint64_t kMaxRuns = uint64_t(1) << 32; // most bytes of a file

struct ChartOptions {
    std::vector<std::string> inputs;
    std::string output;
    std::string figures; // folder; empty = not given
    bool overwrite = false;
};

std::vector<NamedPath> inputsOf(const ChartOptions& options)
{
    std::vector<NamedPath> inputs;
    for (const std::string& input : options.inputs) // standard input may be redirected from a file
        inputs.push_back({isStandardOutput(input) ? "/dev/stdin" : input, "an input"});
    return inputs;
}

// Checks the outputs, before any input is read. Throws Error.
void checkOutputs(const ChartOptions& options, const Reporter& report)
{
    checkStandardOutput(options.output, "--output", report.json());
    const std::vector<NamedPath> inputs = inputsOf(options);
    std::vector<NamedPath> outputs = {{options.output, "--output"}};
    if (!options.figures.empty())
        outputs.push_back({options.figures, "--figures"});
    checkOutputsDiffer(outputs, inputs);
    checkOutput(options.output, OutputKind::Text, options.overwrite);
    if (options.figures.empty())
        return;
    requireFigures();
    checkOutputFolder(options.figures, options.overwrite);
}

std::string pathOf(const ChartOptions& options, const FigureFile& figure)
{
    return (std::filesystem::path(options.figures) / figure.name).string();
}

// Checks the files of --figures, when their names are known. Throws Error.
void checkFigures(const ChartOptions& options, const std::vector<FigureFile>& figures)
{
    const std::vector<NamedPath> inputs = inputsOf(options);
    std::vector<NamedPath> outputs = {{options.output, "--output"}};
    for (const FigureFile& figure : figures)
        outputs.push_back({pathOf(options, figure), "a figure of --figures"});
    checkOutputsDiffer(outputs, inputs);
}

// Content of all inputs, of one kind, because each kind has a page of its own.
struct ChartInput {
    std::optional<PageKind> kind;
    RunSet runs;
    std::vector<ChartTrace> traces;

    [[nodiscard]] size_t points() const // number of points of all curves
    {
        size_t count = 0;
        for (const ChartCurve& curve : runs.curves)
            count += curve.rows.size();
        return count;
    }
};

const char* nameOf(PageKind kind)
{
    return kind == PageKind::Service ? "traces of a service" : kind == PageKind::Curve ? "curves of models" : "runs";
}

void checkOneKind(const ChartInput& input, const std::string& path, PageKind kind)
{
    if (input.kind && *input.kind != kind)
        throw Error(ErrorCode::Usage, path, std::string("holds ") + nameOf(kind),
                    std::string(nameOf(*input.kind)) + " as before it", "draw them with a command of their own");
}

ChartInput readInput(const ChartOptions& options, Reporter& report)
{
    ChartInput found;
    RunSet& runs = found.runs;
    for (const std::string& input : options.inputs) {
        const std::string text =
            readInputText(input, kMaxRuns, "rows of gsc-play bench or gsc bake --curve, or the trace of a service");
        const size_t rows = runs.rows.size(), points = found.points();
        if (isTraceText(text))
            addTraces(text, input, found.traces);
        else
            addRuns(text, input, runs);
        const auto take = [&](PageKind kind) {
            checkOneKind(found, input, kind);
            found.kind = kind;
        };
        if (isTraceText(text)) // asked of the text, because a file of runs may have none
            take(PageKind::Service);
        if (runs.rows.size() > rows)
            take(PageKind::Runs);
        if (found.points() > points)
            take(PageKind::Curve);
    }
    foldRepeats(runs);
    for (const std::string& note : runs.notes)
        report.warning(note);
    if (!found.kind)
        throw Error(
            ErrorCode::InvalidFile, options.inputs.front() + (options.inputs.size() > 1 ? " and the others" : ""),
            std::string("no line of ") + kRunSchema + " in it", "at least one", "gsc-play bench --out writes them");
    return found;
}

Json comparisonsJson(const Json& model)
{
    Json comparisons = Json::array();
    for (const Json& panel : model["panels"]) {
        Json front = Json::array();
        for (const Json& index : panel["views"]["min"]["front"]) {
            const Json& row = panel["rows"][index.get<size_t>()];
            front.push_back({{"name", row["name"]},
                             {"ms", row["ms"]["median"]},
                             {"repeats", row["repeats"]},
                             {"speedup", row["speedup"]},
                             {"psnr_min", row["min"]}});
        }
        Json verdict = Json::array();
        for (const Json& floor : panel["verdict"]["floors"]) {
            const Json name =
                floor["row"].is_null() ? Json(nullptr) : panel["rows"][floor["row"].get<size_t>()]["name"];
            verdict.push_back({{"psnr_min", floor["psnr"]}, {"name", name}});
        }
        comparisons.push_back({{"title", panel["title"]},
                               {"runs", panel["rows"].size()},
                               {"verdict", std::move(verdict)},
                               {"front", std::move(front)}});
    }
    return comparisons;
}

Json tracesJson(const std::vector<ChartTrace>& traces)
{
    Json list = Json::array();
    for (const ChartTrace& trace : traces)
        list.push_back({{"title", trace.title},
                        {"submitted", trace.counts.submitted},
                        {"shown", trace.counts.shown},
                        {"latency_ms", {{"p50", trace.latency.p50}, {"p99", trace.latency.p99}}},
                        {"workers", trace.workers.size()}});
    return list;
}

Json curvesJson(const std::vector<ChartCurve>& curves)
{
    Json list = Json::array();
    for (const ChartCurve& curve : curves)
        list.push_back({{"model", curve.rows.front().file.path}, {"points", curve.rows.size()}});
    return list;
}

Json reportJson(const ChartOptions& options, const ChartInput& input, const Json& model,
                const std::vector<FigureFile>& figures)
{
    const RunSet& runs = input.runs;
    Json names = Json::array();
    for (const FigureFile& figure : figures)
        names.push_back(figure.name);
    return {{"schema", "gsc.chart/1"},
            {"tool", {{"name", "gsc"}, {"version", toolVersion()}}},
            {"output", options.output},
            {"runs", runs.rows.size()},
            {"skipped", runs.skipped},
            {"repeats", runs.repeats},
            {"duplicates", runs.duplicates},
            {"comparisons", input.kind == PageKind::Runs ? comparisonsJson(model) : Json::array()},
            {"traces", tracesJson(input.traces)},
            {"curves", curvesJson(input.runs.curves)},
            {"figures", std::move(names)}};
}

ErrorCode runChart(const ChartOptions& options, Reporter& report)
{
    checkOutputs(options, report);
    const ChartInput input = readInput(options, report);
    const Json model = input.kind == PageKind::Service ? traceModel(input.traces)
                       : input.kind == PageKind::Curve ? curveModel(input.runs.curves)
                                                       : chartModel(input.runs.rows);
    const std::string page = chartPage(model);
    std::vector<FigureFile> figures;
    if (!options.figures.empty())
        figures = drawFigures(model, [&](size_t done, size_t total) { report.progress("figures", done, total); });

    checkFigures(options, figures);

    OutputFiles written(options.overwrite);
    if (!options.figures.empty())
        written.makeFolder(options.figures);
    for (const FigureFile& figure : figures)
        written.add(pathOf(options, figure), OutputKind::Binary, figure.bytes);
    written.add(options.output, OutputKind::Text, page);
    written.commit();
    report.endProgress(false);
    if (report.json())
        report.object(reportJson(options, input, model, figures));
    const size_t count =
        input.runs.rows.size() + input.traces.size() + input.runs.curves.size(); // two of the three are 0
    const char* const what = input.kind == PageKind::Service ? "trace"
                             : input.kind == PageKind::Curve ? "curve"
                                                             : "run";
    report.done(formatString("charted %s in %s", formatCount(count, what).c_str(), options.output.c_str()));
    return ErrorCode::Ok;
}

} // namespace

void addChartCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ChartOptions>();
    CLI::App& command = addCommand(app, "chart",
                                   "Draw measurements as one HTML page: speed and accuracy of runs, a trace of a "
                                   "service, or size against quality");
    addTexts(
        command, "RUNS", options->inputs, "FILE.jsonl...",
        "measurements from gsc-play bench --out, gsc-play stability --format json or gsc bake --curve, or traces from "
        "gsc-play live --trace; - is standard input")
        .required();
    addText(command, "-o,--output", options->output, "FILE.html", "HTML page to write; - is standard output")
        .required();
    addFlag(command, "-w,--overwrite", options->overwrite, "replace files that exist");
    addText(command, "--figures", options->figures, "DIR",
            "folder for every figure of the page as SVG and PNG, besides the page");
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "The page needs no network. Lines with another kind of JSON are skipped, with a\n"
                       "warning. Rows with equal settings are repeats of one run: the\n"
                       "page shows the one in the middle by time, the least and the largest time, and\n"
                       "the worst accuracy.\n"
                       "\n"
                       "examples:\n"
                       "  gsc chart runs.jsonl -o report.html\n"
                       "  gsc chart cpu.jsonl cuda.jsonl -o report.html --figures figures");
    onParsed(command, invocation, options, runChart);
}

} // namespace gsc
