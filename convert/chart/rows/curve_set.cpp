// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/rows/curve_set.h"

#include "convert/chart/rows/row_lines.h"
#include <gsc/error.h>
#include "runtime/records/timed_details.h"

#include <algorithm>
#include <iterator>

namespace gsc {

namespace {

const FieldKind kDetailTimes = {[](const OrderedJson& v) {
                                    return v.is_object() && std::ranges::all_of(kTimedDetails, [&v](unsigned detail) {
                                               const auto ms = v.find(std::to_string(detail));
                                               return ms != v.end() && kPositive.fits(*ms);
                                           });
                                },
                                "milliseconds of the details 0, 1, 2 and 4"};

// As one value: the path of a field "0" would make an array.
void describeDetails(const Record& at, std::vector<double>& ms)
{
    if (!at.hasPart("detail_ms", !ms.empty()))
        return;
    OrderedJson times = OrderedJson::object();
    for (size_t i = 0; i < ms.size(); ++i)
        times[std::to_string(kTimedDetails[i])] = ms[i];
    at.field("detail_ms", times, kDetailTimes);
    ms.clear();
    for (const unsigned detail : kTimedDetails)
        ms.push_back(times[std::to_string(detail)].get<double>());
}

CurveRow parsedRow(std::string_view line, const std::string& where)
{
    const OrderedJson json = rowOf(line, where, "one object per line as gsc bake --curve writes them");
    const Record record(json, where, "gsc.curve/1");
    CurveRow row;
    record.field("schema", row.schema, kText);
    if (row.schema.starts_with("gsc.curve/") && row.schema != "gsc.curve/1")
        throw Error(ErrorCode::Unsupported, where, "schema is " + row.schema, "gsc.curve/1",
                    "use the gsc of the program that wrote it");
    record.check("schema", row.schema == "gsc.curve/1", "gsc.curve/1");
    describe(record, row);
    return row;
}

} // namespace

void describe(const Record& at, CurveRow& row)
{
    at.field("schema", row.schema, kText);
    describe(at.object("tool"), row.tool);
    at.field("model", row.model, kText);
    at.field("device", row.device, kName);
    at.field("tier", row.tier, kName);
    at.field("most_pixels", row.most_pixels, kCount);
    at.field("model_anchors", row.model_anchors, kCount);
    at.fieldOrNull("target_psnr", row.target_psnr, kPositive, -1.0);
    at.field("anchors", row.anchors, kCount);
    at.field("bytes", row.bytes, kCount);
    at.field("archive_bytes", row.archive_bytes, kCount);
    at.field("resident_bytes", row.resident_bytes, kCount);
    at.field("frame_ms", row.frame_ms, kPositive);
    at.field("decode_ms", row.decode_ms, kPositive);
    describeDetails(at, row.detail_ms);
    at.field("poses", row.poses, kCount);
    at.fieldOrNull("psnr", row.psnr, kNumber, double(INFINITY));
    at.fieldOrNull("worst_psnr", row.worst_psnr, kNumber, double(INFINITY));
    at.field("worst", row.worst, kText);
    at.field("ssim", row.ssim, kNumber);
    at.field("worst_ssim", row.worst_ssim, kNumber);
    at.field("flip", row.flip, kPositive);
    at.field("worst_flip", row.worst_flip, kPositive);
}

bool isCurveText(std::string_view text)
{
    return startsWithSchema(text, "gsc.curve/");
}

void addCurves(std::string_view text, const std::string& path, std::vector<ChartCurve>& curves)
{
    forEachRow(text, path, [&](std::string_view line, const std::string& where) {
        CurveRow row = parsedRow(line, where);
        const auto isOf = [&row](const ChartCurve& curve) {
            const CurveRow& first = curve.rows.front();
            return first.model == row.model && first.device == row.device && first.tier == row.tier &&
                   first.most_pixels == row.most_pixels && first.model_anchors == row.model_anchors;
        };
        const auto found = std::ranges::find_if(curves, isOf);
        ChartCurve& curve = found == curves.end() ? curves.emplace_back() : *found;
        if (curve.rows.empty() && row.target_psnr >= 0)
            throw Error(ErrorCode::InvalidFile, where, formatString("%s at %g dB", row.model.c_str(), row.target_psnr),
                        "a line of the model itself, without a target, before it", "write the curve again");
        if (std::ranges::find(curve.rows, row.target_psnr, &CurveRow::target_psnr) != curve.rows.end())
            throw Error(ErrorCode::InvalidFile, where, row.model + " has such a line already", "each target once",
                        "pass each file once");
        curve.rows.push_back(std::move(row));
    });
}

} // namespace gsc
