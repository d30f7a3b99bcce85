// SPDX-License-Identifier: Apache-2.0
#include <gsc/gsc_reader.h>

#include "format/validate/gsc_validate.h"

namespace gsc {

using namespace validate;

namespace {

bool openFront(Context& context)
{
    if (!checkHeader(context) || !checkTable(context))
        return false;
    checkManifest(context);
    return checkParams(context) && checkLevels(context);
}

} // namespace

bool openGsc(std::span<const std::byte> file, GscView& view, GscCheck check, const IssueSink& sink)
{
    view = {};
    IssueLog log(sink);
    Context context{ByteView(file), view, log};
    if (!openFront(context))
        return false;
    checkPadding(context);
    checkSectionChecksums(context, SummaryOnly::No);
    if (!bindSections(context))
        return false;
    checkNanoVdb(context);
    // each of the three checks relies on the ranges that the one before it checked
    const bool sound = checkChunks(context) && checkGroups(context) && checkLeaves(context);
    checkIndex(context);
    checkSensitivity(context, sound);
    checkTile(context);
    const bool mlps_sound = checkMlps(context);
    const bool packed_sound = checkPacked(context);
    checkEmbedding(context);
    checkCameras(context);
    if (check == GscCheck::Full && mlps_sound && packed_sound)
        checkPackedContent(context);
    if (check == GscCheck::Full && sound)
        checkPayloads(context);
    return log.errors() == 0;
}

bool openGscSummary(std::span<const std::byte> file, GscView& view, const IssueSink& sink)
{
    view = {};
    IssueLog log(sink);
    Context context{ByteView(file), view, log};
    const bool complete = openFront(context);
    if (complete)
        checkSectionChecksums(context, SummaryOnly::Yes);
    return complete && log.errors() == 0;
}

std::span<const std::byte> chunkPayload(const GscView& view, const ChunkRecord& chunk)
{
    return view.anchors.subspan(size_t(chunk.payload_offset), size_t(chunk.payload_bytes));
}

} // namespace gsc
