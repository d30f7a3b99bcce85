// SPDX-License-Identifier: Apache-2.0
// Overlay of the picture: a panel of facts, plots and controls, the help, a legend of colours and lines of text. It is
// plain data: the presenter draws it and writes the person's changes into it.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

struct OverlayItem {
    enum class Kind : uint32_t { Heading, Text, Plot, Toggle, Choice, Slider, Button, Colour };
    Kind kind = Kind::Text;
    std::string label; // label of the item, unique among the items below one heading
    // value of a Text; in a Plot it stands in place of the last number; for other kinds a hint, such as the key that
    // does the same
    std::string text;
    bool enabled = true;

    bool on = false;                      // value of a Toggle; for a Heading: the items below it are shown
    int choice = 0;                       // index of the chosen one of `choices`, -1 = none; for a Choice
    std::vector<std::string> choices;     // names that a Choice offers
    float value = 0, least = 0, most = 1; // value and range of a Slider
    float colour[3] = {};                 // red, green and blue of a Colour, 0 to 1, as displayed
    std::vector<float> history;           // values of a Plot, the oldest first; the last is also printed as a number
    bool changed = false; // true once the person changed the item; whoever reads the change sets it to false
};

// A line of text that is drawn over everything else.
struct OverlayNote {
    enum class Align : uint32_t { Left, Middle, Right };
    Align align = Align::Left; // whether the left end, the middle or the right end of the text lies at x
    float x = 0, y = 0; // place as a share of the window's width and height; the text lies below y = 0 and above y = 1
    std::string text;
};

// Colours and their meanings, drawn under the notes at the top.
struct OverlayLegend {
    struct Colour {
        float rgb[3];
        std::string text;
    };
    std::string title;
    std::vector<Colour> colours; // colours to explain; empty = no legend is shown
};

struct Overlay {
    bool panel = false, help = false;
    bool takes_keys = false; // true: keys move through the panel and not the camera
    std::vector<OverlayItem> items;
    std::vector<std::pair<std::string, std::string>> keys; // lines of the help: a key and its effect
    std::vector<OverlayNote> notes;
    OverlayLegend legend;
    std::string message; // message at the bottom edge
};

} // namespace gsc
