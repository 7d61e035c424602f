int main(int, char **arguments) {
    FILE *file = fopen(arguments[1], "rb");
    for (uint32_t word; fread(&word, 4, 1, file) == 1;) input.push_back(word);
    fclose(file);
    while (position < input.size()) calls[input[position++]]();
    file = fopen(arguments[2], "wb");
    fwrite(output.data(), 4, output.size(), file);
    return fclose(file);
}
