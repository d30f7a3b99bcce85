// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include "convert/commands/output_name.h"

#include "format/archive/archive.h"
#include <gsc/file/mapped_file.h>
#include <gsc/file/output_file.h>
#include "format/file/stand_in.h"
#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>
#include <gsc/interrupt.h>

#include <algorithm>

namespace gsc {

namespace {

struct ArchiveCommand {
    std::string file, output;
    ArchiveOptions archive;
    bool extract = false, overwrite = false;
};

void tell(const ArchiveCommand& options, const ArchiveSizes& sizes, uint64_t anchors, Reporter& report)
{
    Json sections = Json::array();
    std::string text;
    if (options.extract)
        text = formatString("wrote       %s, %s, unpacked from an archive of %s\n", options.output.c_str(),
                            formatBytes(sizes.raw_bytes).c_str(), formatBytes(sizes.stored_bytes).c_str());
    else
        text = formatString("wrote       %s, %s of %s (%.1f %%), %.1f bytes an anchor\n", options.output.c_str(),
                            formatBytes(sizes.stored_bytes).c_str(), formatBytes(sizes.raw_bytes).c_str(),
                            100.0 * double(sizes.stored_bytes) / double(sizes.raw_bytes),
                            double(sizes.stored_bytes) / double(anchors));
    for (const ArchiveSize& section : sizes.sections) {
        const std::string name = fourCcText(section.type);
        sections.push_back({{"name", name}, {"bytes", section.stored_bytes}, {"runtime_bytes", section.raw_bytes}});
        text += formatString("%-11s %s of %s\n", name.c_str(), formatBytes(section.stored_bytes).c_str(),
                             formatBytes(section.raw_bytes).c_str());
    }
    if (report.json())
        report.object({{"schema", "gsc.archive/1"},
                       {"path", options.file},
                       {"output", options.output},
                       {"profile", options.extract ? "runtime" : "archive"},
                       {"anchors", anchors},
                       {"bytes", sizes.stored_bytes},
                       {"runtime_bytes", sizes.raw_bytes},
                       {"sections", std::move(sections)}});
    else
        report.text(text);
}

ErrorCode runArchive(const ArchiveCommand& options, Reporter& report)
{
    checkGscName(options.output);
    checkOutputsDiffer(std::vector<NamedPath>{{options.output, "--output"}},
                       std::vector<NamedPath>{{options.file, "FILE"}});
    checkOutput(options.output, OutputKind::Binary, options.overwrite);
    const MappedFile mapped(options.file);
    refuseStandIn(mapped.bytes(), mapped.bytes().size(), options.file);
    if (isArchive(mapped.bytes()) != options.extract)
        throw Error(ErrorCode::Usage, options.file, options.extract ? "a runtime file" : "an archive already",
                    options.extract ? "an archive" : "a runtime file",
                    options.extract ? "leave --extract out to make one" : "--extract writes that");
    const IssueSink sink = throwFirstIssue(options.file);
    const GscFile file(options.file, sink, GscFile::Read::All, options.archive.threads);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Full, sink);
    const uint64_t anchors = view.header->anchor_count;
    ArchiveSizes sizes;
    if (options.extract) {
        OutputFile output(options.output, OutputKind::Binary, options.overwrite);
        constexpr size_t kBlock = 64 << 20;
        for (size_t at = 0; at < file.bytes().size(); at += kBlock) {
            throwIfInterrupted();
            output.write(file.bytes().subspan(at, std::min(kBlock, file.bytes().size() - at)));
            report.progress("extract", std::min(at + kBlock, file.bytes().size()), file.bytes().size());
        }
        output.sync();
        throwIfInterrupted();
        output.commit();
        sizes.raw_bytes = file.bytes().size();
        sizes.stored_bytes = file.storedBytes();
    } else {
        sizes = writeArchive(file.bytes(), view, options.output, options.overwrite, options.archive,
                             [&](uint64_t done, uint64_t all) { report.progress("archive", done, all); });
    }
    tell(options, sizes, anchors, report);
    report.done((options.extract ? "unpacked " : "archived ") + options.file);
    return ErrorCode::Ok;
}

} // namespace

void addArchiveCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ArchiveCommand>();
    CLI::App& command = addCommand(app, "archive", "Pack a .gsc file for storage, or unpack it, without loss");
    addText(command, "FILE", options->file, "FILE.gsc", "file to pack, or an archive to unpack").required();
    addText(command, "-o,--output", options->output, "FILE.gsc", "file to write").required();
    addFlag(command, "-x,--extract", options->extract, "unpack: write the file that was packed, byte for byte");
    addInteger(command, "--level", options->archive.level, 1, 19, "N (default: 3)",
               "compression level of Zstandard, 1 (fastest) to 19 (smallest)");
    addInteger(command, "-j,--threads", options->archive.threads, 0, 1024, "N (default: 0)",
               "threads, 0 = all cores; the file does not depend on it");
    addFlag(command, "-w,--overwrite", options->overwrite, "replace a file that exists");
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "gsc and gsc-play read an archive like any .gsc file: they unpack it into memory\n"
                       "first.\n"
                       "\n"
                       "examples:\n"
                       "  gsc archive city.gsc -o city.archive.gsc\n"
                       "  gsc archive --extract city.archive.gsc -o city.gsc");
    onParsed(command, invocation, options, runArchive);
}

} // namespace gsc
