declare module "virtual:kernel" {
  export const fast: string;
  export const plain: string;
}
