// SPDX-License-Identifier: Apache-2.0
#include "player/window/window_log.h"

namespace gsc {

OrderedJson windowLine(const WindowFrame& frame)
{
    const bool compares = frame.shows != "picture";
    return {
        {"frame", frame.frame},
        {"seconds", frame.seconds},
        {"pose", frame.pose},
        {"asked", frame.asked},
        {"keys", frame.keys},
        {"size", {frame.width, frame.height}},
        {"refresh_ms", frame.refresh_ms},
        {"latency_ms", frame.latency_ms},
        {"anchors_absent", frame.anchors_absent},
        {"lod_bias", frame.pose == 0 ? OrderedJson() : OrderedJson(frame.lod_bias)},
        {"detail", frame.pose == 0 ? OrderedJson() : OrderedJson(frame.detail)},
        {"fovea_pixels", frame.fovea_pixels > 0 ? OrderedJson(frame.fovea_pixels) : OrderedJson()},
        {"position", frame.position},
        {"speed", frame.speed},
        {"shows", frame.shows},
        {"psnr", compares ? jsonNumber(frame.psnr) : OrderedJson()},
        {"flip", compares && frame.flip >= 0 ? OrderedJson(frame.flip) : OrderedJson()},
        {"wrote", frame.wrote.empty() ? OrderedJson() : OrderedJson(frame.wrote)},
        {"said", frame.said.empty() ? OrderedJson() : OrderedJson(frame.said)},
    };
}

} // namespace gsc
