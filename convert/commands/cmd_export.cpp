// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/grids/grid_files.h"
#include "format/file/output_file.h"
#include "format/gsc_file.h"

namespace gsc {

namespace {

struct ExportOptions {
    std::string file, output;
    GridFileFormat to = GridFileFormat::NanoVdb;
    bool overwrite = false;
};

const char* formatName(GridFileFormat format)
{
    return format == GridFileFormat::NanoVdb ? "nvdb" : "vdb";
}

ErrorCode runExport(const ExportOptions& options, Reporter& report)
{
    checkOutputsDiffer(std::vector<NamedPath>{{options.output, "--output"}},
                       std::vector<NamedPath>{{options.file, "FILE"}});
    checkOutput(options.output, OutputKind::Binary, options.overwrite);
    const IssueSink sink = throwFirstIssue(options.file);
    const GscFile file(options.file, sink);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Index, sink);
    OutputFile output(options.output, OutputKind::Binary, options.overwrite);
    uint64_t bytes = 0;
    const std::vector<ExportedGrid> grids = writeGridFile(view, options.to, sink, [&](std::string_view piece) {
        output.write(piece);
        bytes += piece.size();
    });
    output.sync();
    output.commit();

    Json levels = Json::array();
    std::string text =
        formatString("wrote       %s, %s, %s\n", options.output.c_str(), formatBytes(bytes).c_str(),
                     options.to == GridFileFormat::NanoVdb ? "NanoVDB mask grids" : "OpenVDB mask grids");
    for (const ExportedGrid& grid : grids) {
        levels.push_back({{"level", grid.level},
                          {"name", grid.name},
                          {"leaves", grid.leaves},
                          {"voxels", grid.voxels},
                          {"voxel_size", grid.voxel_size}});
        text += formatString("level %-5d %s: %s leaves, %s voxels that hold anchors, %g wide\n", grid.level,
                             grid.name.c_str(), formatCount(grid.leaves).c_str(), formatCount(grid.voxels).c_str(),
                             grid.voxel_size);
    }
    if (report.json())
        report.object({{"schema", "gsc.export/1"},
                       {"path", options.file},
                       {"output", options.output},
                       {"to", formatName(options.to)},
                       {"bytes", bytes},
                       {"grids", std::move(levels)}});
    else
        report.text(text);
    report.done("exported " + options.file);
    return ErrorCode::Ok;
}

} // namespace

void addExportCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ExportOptions>();
    CLI::App& command = addCommand(app, "export", "Write what a .gsc file holds in another tool's form");
    addText(command, "FILE", options->file, "FILE.gsc", "file to read").required();
    addChoice<GridFileFormat>(command, "--to", options->to,
                              {{formatName(GridFileFormat::NanoVdb), GridFileFormat::NanoVdb},
                               {formatName(GridFileFormat::OpenVdb), GridFileFormat::OpenVdb}},
                              "", "form: the grids, one per level, for NanoVDB's tools or for OpenVDB's")
        .required();
    addText(command, "-o,--output", options->output, "FILE", "file to write").required();
    addFlag(command, "-w,--overwrite", options->overwrite, "replace a file that exists");
    addReporterOptions(command, invocation.reporter, false);
    setFooter(command, "A grid is a mask: its voxels are the cells that hold anchors, in the model's world space.\n\n"
                       "examples:\n"
                       "  gsc export city.gsc --to vdb -o city.vdb\n"
                       "  vdb_print -l city.vdb\n"
                       "  gsc export city.gsc --to nvdb -o city.nvdb");
    onParsed(command, invocation, options, runExport);
}

} // namespace gsc
