// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/accuracy.h"

#include <gsc/error.h>
#include "runtime/records/report_parts.h"

namespace gsc {

namespace {

std::string partText(const FoveaAccuracy::Part& part)
{
    if (part.share == 0)
        return "no pixel";
    std::string text = formatString("PSNR %s pooled, %s worst", decibels(boundedPsnr(part.psnr_pooled), " dB").c_str(),
                                    decibels(boundedPsnr(part.psnr_min), " dB").c_str());
    return part.flip < 0 ? text : text + formatString(", FLIP %.4f", part.flip);
}

} // namespace

std::string foveaText(const FoveaAccuracy& accuracy)
{
    return "within 12 degrees of the gaze: " + partText(accuracy.inside) +
           "; around it: " + partText(accuracy.outside) + "\n";
}

} // namespace gsc
